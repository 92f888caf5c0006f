"""Every format is read back by software of others, and says what the data set says."""

import csv
import hashlib
import json
import os
import signal
import subprocess
import sys
from dataclasses import fields, replace

import h5py
import mlcroissant
import numpy as np
import pandas as pd
import pytest
import trimesh
import yaml

from logs.dataset.dataset import merge
from logs.dataset.files import FORMATS, read_dataset, read_manifest, write_dataset
from logs.dataset.sources import load_labeled
from logs.errors import DatasetError
from logs.export.grasps import GraspSummary
from logs.export.isaac_grasp import isaac_files
from reach.errors import UnknownNameError
from reach.transforms import rotation_from_quat_wxyz


@pytest.fixture(scope="module")
def written(tmp_path_factory, make_dataset):
    dataset = make_dataset(objects=3, grasps=4, repeats=3)
    folder = tmp_path_factory.mktemp("export") / "made-up"
    write_dataset(dataset, folder, FORMATS)
    return dataset, folder


def same(a, b):
    """Deep equality of frozen dataclasses that hold arrays."""
    if isinstance(a, np.ndarray):
        return np.array_equal(a, b)
    if isinstance(a, tuple):
        return len(a) == len(b) and all(map(same, a, b))
    if hasattr(a, "__dataclass_fields__"):
        return type(a) is type(b) and all(
            same(getattr(a, f.name), getattr(b, f.name)) for f in fields(a)
        )
    return a == b


def contents(folder):
    return {
        str(path.relative_to(folder)): path.read_bytes()
        for path in sorted(folder.rglob("*"))
        if path.is_file()
    }


@pytest.mark.parametrize("formats", [("parquet",), ("csv",), FORMATS])
def test_reads_back_exactly(make_dataset, tmp_path, formats):
    dataset = make_dataset()
    write_dataset(dataset, tmp_path / "d", formats)
    again = read_dataset(tmp_path / "d")
    assert len(again.trials) == len(dataset.trials)
    for before, after in zip(dataset.trials, again.trials, strict=True):
        assert same(before, after)
    for name, part in dataset.objects.items():
        assert again.objects[name].content_hash == part.content_hash
        assert again.objects[name].mass == part.mass
        np.testing.assert_array_equal(again.objects[name].com, part.com)
    assert again.left_out == dataset.left_out
    assert again.pose_error == dataset.pose_error
    assert same(again.gripper, dataset.gripper)


def test_same_data_same_bytes(make_dataset, tmp_path):
    for name in ("a", "b"):
        write_dataset(make_dataset(), tmp_path / name, FORMATS)
    first, second = contents(tmp_path / "a"), contents(tmp_path / "b")
    assert first == second
    write_dataset(read_dataset(tmp_path / "a"), tmp_path / "c", FORMATS)
    assert contents(tmp_path / "c") == first


def test_pandas_reads_the_tables(written):
    dataset, folder = written
    parquet = pd.read_parquet(folder / "trials.parquet")
    text = pd.read_csv(folder / "trials.csv")
    assert list(parquet.columns) == list(text.columns)
    assert len(parquet) == len(text) == len(dataset.trials)
    assert parquet["success"].sum() == text["success"].sum() == dataset.successes
    assert parquet["simulated"].all() and text["simulated"].all()
    expected = dataset.trials[7].T_object_gripper
    np.testing.assert_array_equal(
        np.reshape(parquet["T_object_gripper_planned"][7], (4, 4)), expected
    )
    np.testing.assert_array_equal(
        np.reshape(json.loads(text["T_object_gripper_planned"][7]), (4, 4)), expected
    )
    assert json.loads(parquet["score_reach_parameters"][0]) == {"friction": 0.5, "saturate": True}
    assert parquet["score_point"].isna().sum() == sum(
        "point" not in t.scores for t in dataset.trials
    )


def test_parquet_columns_carry_meaning_and_unit(written):
    import pyarrow.parquet as pq

    schema = pq.read_schema(written[1] / "trials.parquet")
    for field in schema:
        assert field.metadata[b"meaning"]
    assert schema.field("jaw_width").metadata[b"unit"] == b"m"


def test_csv_survives_quotes_and_newlines(written):
    dataset, folder = written
    with (folder / "trials.csv").open(newline="") as stream:
        rows = list(csv.DictReader(stream))
    assert rows[1]["note"] == 'said "no", then\nyes' == dataset.trials[1].label.note


def test_meshes_open_in_trimesh(written):
    dataset, folder = written
    manifest = read_manifest(folder)
    for name, entry in manifest.objects.items():
        mesh = trimesh.load_mesh(folder / entry.mesh)
        assert mesh.is_watertight
        assert mesh.volume == pytest.approx(dataset.objects[name].volume)


def test_graspgen_json(written):
    dataset, folder = written
    content = json.loads((folder / "graspgen" / "part_1.json").read_text())
    assert (folder / "graspgen" / content["object"]["file"]).is_file()
    assert content["object"]["scale"] == 1.0
    transforms = np.array(content["grasps"]["transforms"])
    labels = content["grasps"]["object_in_gripper"]
    assert transforms.shape == (4, 4, 4) and len(labels) == 4
    assert all(isinstance(label, bool) for label in labels)
    assert content["simulated"] is True
    grasps = [ts for ts in dataset.by_grasp().values() if ts[0].object_name == "part 1"]
    for transform, label, trials in zip(transforms, labels, grasps, strict=True):
        np.testing.assert_array_equal(transform, trials[0].T_object_gripper)
        assert label == (sum(t.label.success for t in trials) * 2 > len(trials))


def test_isaac_yaml(written):
    dataset, folder = written
    content = yaml.safe_load((folder / "isaac_grasp" / "part_0.yaml").read_text())
    assert content["format"] == "isaac_grasp" and content["format_version"] == 1.0
    assert len(content["grasps"]) == 4
    trials = [ts for ts in dataset.by_grasp().values() if ts[0].object_name == "part 0"]
    for grasp, (first, *_) in zip(content["grasps"].values(), trials, strict=True):
        w, xyz = grasp["orientation"]["w"], grasp["orientation"]["xyz"]
        T = first.T_object_gripper
        np.testing.assert_allclose(rotation_from_quat_wxyz([w, *xyz]), T[:3, :3], atol=1e-12)
        np.testing.assert_array_equal(grasp["position"], T[:3, 3])
        assert 0 <= grasp["confidence"] <= 1
        closed, opened = grasp["cspace_position"], grasp["pregrasp_cspace_position"]
        assert set(closed) == {"jaw_0", "jaw_1"} and closed["jaw_0"] <= opened["jaw_0"] == 0.025


def test_isaac_leaves_out_a_width_that_nobody_knows(make_dataset):
    row = GraspSummary("g", np.eye(4), 0, 2, None, simulated=True)
    files = isaac_files(make_dataset(objects=1), {"a": [row]}, {"a": "a"})
    grasp = yaml.safe_load(files["isaac_grasp/a.yaml"])["grasps"]["grasp_0"]
    assert "cspace_position" not in grasp and "pregrasp_cspace_position" in grasp


def test_acronym_hdf5(written):
    dataset, folder = written
    with h5py.File(folder / "acronym" / "part_2.h5") as file:
        assert bool(file.attrs["simulated"])
        transforms = file["grasps/transforms"]
        assert transforms.shape == (4, 4, 4) and transforms.dtype == np.float64
        lifted = file["grasps/qualities/flex/object_in_gripper"]
        assert lifted.shape == (4,) and lifted.dtype == np.int8
        assert np.all(np.isnan(file["grasps/qualities/flex/object_motion_during_closing_linear"]))
        assert file["gripper/type"][()] == b"yumi"
        np.testing.assert_array_equal(file["gripper/configuration"], [0.025, 0.025])
        part = dataset.objects["part 2"]
        assert file["object/mass"][()] == part.mass
        assert file["object/volume"][()] == pytest.approx(part.volume)
        assert (folder / file["object/file"][()].decode()).is_file()
        np.testing.assert_array_equal(file["object/com"], part.com)
        x, y, z = np.ptp(part.vertices, axis=0)
        expected = part.mass / 12 * np.diag([y * y + z * z, x * x + z * z, x * x + y * y])
        np.testing.assert_allclose(file["object/inertia"], expected, atol=1e-12)


@pytest.mark.filterwarnings("ignore::DeprecationWarning")  # rdflib's own, inside mlcroissant
def test_croissant_is_valid_and_loads_the_table(written):
    dataset, folder = written
    described = mlcroissant.Dataset(jsonld=folder / "croissant.json")
    assert described.metadata.issues.errors == set()
    assert described.metadata.license == ["not stated"]
    rows = list(described.records("trials"))
    assert len(rows) == len(dataset.trials)
    first = rows[0]
    assert first["trials/trial_id"] == dataset.trials[0].trial_id.encode()
    assert first["trials/success"] == dataset.trials[0].label.success
    np.testing.assert_array_equal(
        np.reshape(first["trials/T_object_gripper_planned"], (4, 4)),
        dataset.trials[0].T_object_gripper,
    )


def test_card_counts_what_is_there_and_what_is_not(written):
    dataset, folder = written
    card = (folder / "README.md").read_text()
    assert "**Simulated data.** 36 of 36 trials" in card
    assert "| trials that count | 36 |" in card
    assert f"| stably lifted | {dataset.successes} (" in card
    assert "| executed, not labeled | 1 |" in card
    assert "1 redone, 1 void; 1 labels replace an earlier one" in card
    assert "T_parent_child maps child coordinates to parent" in card
    assert "jaws open 50 mm" in card


def test_license_stands_where_people_and_machines_look(make_dataset, tmp_path, written):
    assert "| license | not stated |" in (written[1] / "README.md").read_text()
    licensed = replace(make_dataset(objects=1), license="CC-BY-4.0")
    write_dataset(licensed, tmp_path / "d", ("parquet",))
    assert "| license | CC-BY-4.0 |" in (tmp_path / "d" / "README.md").read_text()
    assert json.loads((tmp_path / "d" / "croissant.json").read_text())["license"] == "CC-BY-4.0"
    assert read_dataset(tmp_path / "d").license == "CC-BY-4.0"


def test_both_covariances_are_named_with_their_frames(written):
    table = pd.read_parquet(written[1] / "trials.parquet")
    registered = np.reshape(table["registration_covariance"][2], (6, 6))
    in_hand = np.reshape(table["object_in_hand_covariance"][2], (6, 6))
    np.testing.assert_array_equal(registered, np.eye(6) * 1e-6)
    np.testing.assert_array_equal(in_hand, np.eye(6) * 2e-6)
    card = (written[1] / "README.md").read_text()
    assert "relative to the camera" in card and "relative to the gripper" in card
    assert "common to all trials under one set-up" in card


def test_manifest_hashes_every_file(written):
    _, folder = written
    manifest = read_manifest(folder)
    assert manifest.simulated
    found = {p for p in contents(folder) if p != "dataset.json"}
    assert set(manifest.files) == found
    for path, digest in manifest.files.items():
        assert hashlib.sha256((folder / path).read_bytes()).hexdigest() == digest


def test_refusals_leave_nothing_behind(make_dataset, tmp_path):
    dataset = make_dataset(objects=1, grasps=1, repeats=1)
    full = tmp_path / "full"
    full.mkdir()
    (full / "mine.txt").write_text("keep")
    with pytest.raises(DatasetError, match="not empty"):
        write_dataset(dataset, full)
    with pytest.raises(UnknownNameError, match="acronym, csv, graspgen, isaac, parquet, reach2019"):
        write_dataset(dataset, tmp_path / "x", ("excel",))
    empty = type(dataset)(
        **{f.name: getattr(dataset, f.name) for f in fields(dataset)} | {"trials": ()}
    )
    with pytest.raises(DatasetError, match="no trial that counts"):
        write_dataset(empty, tmp_path / "x")
    assert contents(tmp_path) == {"full/mine.txt": b"keep"}
    assert [p.name for p in tmp_path.iterdir()] == ["full"]


def test_an_empty_folder_may_be_filled(make_dataset, tmp_path):
    (tmp_path / "d").mkdir()
    write_dataset(make_dataset(objects=1, grasps=1, repeats=1), tmp_path / "d", ("csv",))
    assert read_dataset(tmp_path / "d").trials


def test_changed_files_are_noticed(make_dataset, tmp_path):
    folder = tmp_path / "d"
    write_dataset(make_dataset(objects=1), folder, ("csv",))
    table = folder / "trials.csv"
    table.write_bytes(table.read_bytes().replace(b"true", b"false", 1))
    with pytest.raises(DatasetError, match=r"trials\.csv was changed"):
        read_dataset(folder)
    table.unlink()
    with pytest.raises(DatasetError, match="missing"):
        read_dataset(folder)


def test_without_a_table_it_cannot_be_read_back(make_dataset, tmp_path):
    write_dataset(make_dataset(objects=1), tmp_path / "d", ("graspgen",))
    with pytest.raises(DatasetError, match="no trial table"):
        read_dataset(tmp_path / "d")
    with pytest.raises(DatasetError, match=r"session\.json.*dataset\.json"):
        load_labeled([tmp_path])
    with pytest.raises(DatasetError, match="does not exist"):
        load_labeled([tmp_path / "absent"])


def test_merging_keeps_equal_grasps_and_parts_different_ones(make_dataset):
    monday = make_dataset(objects=2, seed=1)
    rename = {"trial_id": None, "session": "tuesday"}
    tuesday = _with_trials(monday, rename)
    both = merge([monday, tuesday])
    assert len(both.by_grasp()) == len(monday.by_grasp())
    assert all(len(ts) == 4 for ts in both.by_grasp().values())
    other = _with_trials(make_dataset(objects=2, seed=2), rename)
    apart = merge([monday, other])
    assert len(apart.by_grasp()) == 2 * len(monday.by_grasp())
    with pytest.raises(DatasetError, match="trial id twice"):
        merge([monday, monday])
    heavier = make_dataset(objects=2, faces=100)
    with pytest.raises(
        DatasetError, match=r"another shape, .* mm of .* instead of .* name of its own"
    ):
        merge([monday, _with_trials(heavier, rename)])


def _with_trials(dataset, change):
    trials = tuple(
        replace(t, **(change | {"trial_id": f"{change['session']}-{t.trial_id}"}))
        for t in dataset.trials
    )
    return replace(dataset, trials=trials)


@pytest.mark.slow
def test_a_whole_experiment_is_written_and_read_back(make_dataset, tmp_path):
    dataset = make_dataset(objects=21, grasps=25, repeats=5, faces=1280)
    assert len(dataset.trials) == 2625
    write_dataset(dataset, tmp_path / "d", FORMATS)
    assert len(read_dataset(tmp_path / "d").trials) == 2625


KILLED_WRITER = """
import sys, pickle
from pathlib import Path
import logs.dataset.files as files
dataset = pickle.load(open(sys.argv[1], "rb"))
original = Path.write_bytes
def slow(path, data):
    original(path, data)
    print("wrote", flush=True)
    sys.stdin.readline()
Path.write_bytes = slow
files.write_dataset(dataset, Path(sys.argv[2]), ("parquet", "csv"))
"""


def test_a_killed_writer_leaves_no_half_data_set(make_dataset, tmp_path):
    import pickle

    dataset, target = make_dataset(objects=2), tmp_path / "out" / "d"
    (tmp_path / "value").write_bytes(pickle.dumps(dataset))
    writer = subprocess.Popen(
        [sys.executable, "-c", KILLED_WRITER, str(tmp_path / "value"), str(target)],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
    )
    assert writer.stdout.readline() == "wrote\n"
    os.kill(writer.pid, signal.SIGKILL)
    writer.communicate()
    assert not target.exists()
    assert len(list(target.parent.iterdir())) == 1
    write_dataset(dataset, target, ("parquet", "csv"))
    assert [path.name for path in target.parent.iterdir()] == ["d"]
