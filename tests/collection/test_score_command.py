"""`reach score`: reads what `reach sample` writes and what people have, and answers in JSON."""

import json

import numpy as np
import pytest
import typer
from typer.testing import CliRunner

from collection.cli.sample import sample
from collection.cli.score import score
from collection.grasp_file import rigid
from reach.errors import InvalidInputError, InvalidTransformError, ReachError, UnknownNameError
from reach.transforms import make_transform

CUBE_GRASP = make_transform(None, (0, 0, -0.160)).tolist()


def run(command, *arguments):
    app = typer.Typer()
    app.command()(command)
    result = CliRunner().invoke(app, [str(argument) for argument in arguments])
    if isinstance(result.exception, ReachError):
        raise result.exception
    assert result.exit_code == 0, result.output
    return result.stdout


def write(tmp_path, content):
    path = tmp_path / "grasps.json"
    path.write_text(content if isinstance(content, str) else json.dumps(content))
    return path


def test_sampled_grasps_are_valid_input(tmp_path):
    sampled = run(sample, "--mesh", "cube_3cm", "--count", 6, "--seed", 1, "--json")
    path = write(tmp_path, sampled)
    answer = json.loads(run(score, "--grasps", path, "--models", "reach,point-robust", "--json"))
    assert answer["object"] == "cube_3cm"
    assert set(answer["models"]) == {"reach", "point-robust"}
    assert len(answer["grasps"]) == len(json.loads(sampled)["grasps"])
    for entry in answer["grasps"]:
        assert 0 <= entry["scores"]["point-robust"]["value"] <= 1
        assert entry["scores"]["reach"]["reason"] in ("holds", "no contact", "slips", "torque")
    assert answer["models"]["reach"]["parameters"]["friction"] > 0


def test_a_bare_list_of_poses_and_the_table(tmp_path):
    path = write(tmp_path, [CUBE_GRASP, make_transform(None, (0, 0.1, -0.160)).tolist()])
    arguments = ("--mesh", "cube_3cm", "--grasps", path, "--models", "reach")
    answer = json.loads(run(score, *arguments, "--json"))
    assert [grasp["scores"]["reach"]["value"] for grasp in answer["grasps"]] == [1.0, 0.0]
    assert answer["grasps"][1]["scores"]["reach"]["missing_jaws"] == [0, 1]
    assert "predicted success" in run(score, *arguments)


def test_pose_error_and_seed_reach_the_robust_models(tmp_path):
    path = write(tmp_path, [make_transform(None, (0, 0.022, -0.160)).tolist()])
    arguments = ("--mesh", "cube_3cm", "--grasps", path, "--models", "reach-robust", "--json")
    sure = json.loads(run(score, *arguments, "--pose-error", "1e-5,1e-5"))
    wild = json.loads(run(score, *arguments, "--pose-error", "0.005,0.05", "--seed", 2))
    values = [a["grasps"][0]["scores"]["reach-robust"]["value"] for a in (sure, wild)]
    assert values[0] == 1.0 > values[1]


@pytest.mark.parametrize(
    ("content", "arguments", "message"),
    [
        ("no json", (), "cannot read grasps"),
        ({"grasps": []}, (), "holds no grasps"),
        ([[[1, 0], [0, 1]]], (), "grasp 0: T_object_gripper has shape"),
        ([[[1, 0], [0]]], (), "grasp 0: T_object_gripper has shape"),
        ([CUBE_GRASP, (2 * np.eye(4)).tolist()], (), "grasp 1: T_object_gripper"),
        ({"grasps": [{"pose": 1}]}, (), "grasps.0.T_object_gripper"),
        ([CUBE_GRASP], ("--models", "best"), "unknown model 'best'"),
        ([CUBE_GRASP], ("--pose-error", "3"), "expected meters,radians"),
        ([CUBE_GRASP], ("--force", "-1"), "grasp 0: closing force"),
        ({"gripper": "hand", "grasps": [{"T_object_gripper": CUBE_GRASP}]}, (), "gripper 'hand'"),
    ],
)
def test_bad_input_is_one_clear_error(tmp_path, content, arguments, message):
    path = write(tmp_path, content)
    with pytest.raises((InvalidInputError, UnknownNameError), match=message):
        run(score, "--mesh", "cube_3cm", "--grasps", path, "--models", "reach", *arguments)


def test_the_mesh_must_be_named(tmp_path):
    with pytest.raises(InvalidInputError, match="give --mesh"):
        run(score, "--grasps", write(tmp_path, [CUBE_GRASP]), "--models", "reach")


def test_rotations_of_few_digits_are_projected_and_others_refused():
    rough = np.round(make_transform([[0.6, -0.8, 0], [0.8, 0.6, 0], [0, 0, 1]]), 1) + 0.0
    rough[0, 0] += 0.004
    projected = rigid(tuple(map(tuple, rough)), "T")
    np.testing.assert_allclose(projected[:3, :3] @ projected[:3, :3].T, np.eye(3), atol=1e-12)
    rough[0, 0] += 0.1
    with pytest.raises(InvalidTransformError, match="orthonormal"):
        rigid(tuple(map(tuple, rough)), "T")


@pytest.mark.parametrize("option", ["--pose-error", "--seed", "--mass", "--mesh"])
def test_options_that_recorded_sessions_cannot_take_are_refused(tmp_path, option):
    with pytest.raises(InvalidInputError, match=option):
        run(score, tmp_path, option, "1")
