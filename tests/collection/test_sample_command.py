from __future__ import annotations

import json

import numpy as np
import pytest
import typer
from typer.testing import CliRunner

from collection.cli.objects import objects
from collection.cli.sample import sample
from collection.errors import PlanError
from collection.objects import OBJECT_NAMES, load_object
from reach.transforms import as_transform


def run(function, *arguments: str):
    app = typer.Typer()
    app.command()(function)
    return CliRunner().invoke(app, list(arguments))


def test_sample_prints_a_grasp_file():
    result = run(sample, "--mesh", "bracket", "--count", "5", "--seed", "3", "--json")
    assert result.exit_code == 0
    document = json.loads(result.stdout)
    assert document["object"] == document["mesh"] == "bracket"
    assert (document["mesh_unit"], document["gripper"], document["seed"]) == ("m", "yumi", 3)
    assert len(document["grasps"]) == 5 and document["discarded"]
    part = load_object(document["mesh"])
    for grasp in document["grasps"]:
        as_transform(grasp["T_object_gripper"])
        T_world_object = as_transform(grasp["stable_pose"]["T_world_object"])
        heights = part.vertices @ T_world_object[2, :3] + T_world_object[2, 3]
        assert heights.min() == pytest.approx(0, abs=1e-9)
    again = run(sample, "--mesh", "bracket", "--count", "5", "--seed", "3", "--json")
    assert again.stdout == result.stdout


def test_sample_on_one_stable_pose_without_jitter(tmp_path):
    part = load_object("mug")
    path = tmp_path / "mug.stl"
    path.write_bytes(part.mesh.copy().apply_scale(1000).export(file_type="stl"))
    result = run(
        sample,
        *("--mesh", str(path), "--mesh-unit", "mm", "--stable-pose", "2"),
        *("--no-jitter", "--count", "4", "--json"),
    )
    document = json.loads(result.stdout)
    assert document["mesh"] == str(path) and document["mesh_unit"] == "mm"
    for grasp in document["grasps"]:
        assert grasp["stable_pose"]["index"] == 2
        np.testing.assert_array_equal(grasp["T_object_gripper"], grasp["T_object_gripper_parent"])


def test_sample_prints_a_table():
    result = run(sample, "--mesh", "cube_3cm", "--count", "3")
    assert result.exit_code == 0
    assert "cube_3cm: 3 grasps" in result.stdout and "hits the table" in result.stdout


def test_an_unknown_stable_pose_is_refused():
    result = run(sample, "--mesh", "mug", "--stable-pose", "99")
    assert isinstance(result.exception, PlanError)
    assert "valid: 0 to" in str(result.exception)


def test_objects_lists_the_printable_set():
    result = run(objects, "--json")
    rows = json.loads(result.stdout)
    assert [row["name"] for row in rows] == list(OBJECT_NAMES)
    assert all(sum(row["stable_poses"]) <= 1 + 1e-9 and row["mass"] > 0 for row in rows)


def test_objects_exports_what_is_named(tmp_path):
    result = run(objects, "wedge", "--infill", "1", "--export", str(tmp_path))
    assert result.exit_code == 0 and "1 STL files" in result.stdout
    assert (tmp_path / "wedge.stl").is_file()
    masses = json.loads((tmp_path / "masses.json").read_text())["masses"]
    solid = load_object("wedge").volume * 1240 * 1e3
    assert masses["wedge"] == pytest.approx(solid, abs=0.01)
