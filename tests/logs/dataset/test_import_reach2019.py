"""Reading the published trials of 2019: exact, tolerant where it is said, strict elsewhere."""

import json

import numpy as np
import pytest
import trimesh

from logs.dataset.files import read_dataset, write_dataset
from logs.dataset.from_reach2019 import MassRule, import_reach2019, read_masses
from logs.errors import DatasetError
from reach.errors import InvalidMeshError, UnknownNameError
from reach.transforms import inverse, make_transform, rotation_about


def record(attempt=0, trial=0, **changes):
    """A valid record: an 18 mm high cube on a table at z = 0.009."""
    pose = make_transform(rotation_about((0, 0, 1), 0.3), (0.4, 0.0, 0.018))
    grasp = make_transform(rotation_about((1, 0, 0), np.pi), (0.4, 0.0, 0.18))
    return {
        "obj": "block",
        "pose": pose.tolist(),
        "grasp": grasp.tolist(),
        "tf": np.eye(4).tolist(),
        "result": True,
        "stable_pose": 2,
        "attempt": attempt,
        "trial": trial,
        "qs_cons": True,
        "qs_agg": False,
        "qs_orig": True,
        **changes,
    }


@pytest.fixture
def files(tmp_path):
    """Write records and a mesh; answers the paths."""
    meshes = tmp_path / "meshes"
    meshes.mkdir()
    trimesh.creation.box((0.018, 0.018, 0.018)).export(meshes / "block.stl")

    def make(records, name="block.json"):
        grasps = tmp_path / "grasps"
        grasps.mkdir(exist_ok=True)
        (grasps / name).write_text(json.dumps(records, indent=1))
        return grasps, meshes

    return make


def read(files, records, grams=None):
    grasps, meshes = files(records)
    return import_reach2019(grasps, meshes, MassRule(grams or {}))


def test_a_mass_that_fits_no_object_is_told(files):
    """A misspelled name would else fall back to an assumed mass in silence."""
    assert "no trial has: blokc." in read(files, [record()], {"blokc": 30.0}).notes[-1]
    told = " ".join(read(files, [record()], {"block": 30.0}).notes)
    assert "no trial has" not in told


def test_poses_table_and_labels(files):
    dataset = read(files, [record(), record(trial=1, result=False)])
    first, second = dataset.trials
    np.testing.assert_allclose(
        first.T_object_gripper,
        inverse(np.array(record()["pose"])) @ np.array(record()["grasp"]),
        atol=1e-12,
    )
    assert first.table_height == pytest.approx(0.009)  # lowest vertex of the posed mesh
    assert (first.label.success, second.label.success) == (True, False)
    assert first.grasp_id == second.grasp_id
    assert not dataset.simulated
    (case,) = dataset.cases()
    assert (case.successes, case.trials) == (1, 2)
    assert case.scene.table_height == first.table_height


def test_round_trip_is_exact_to_the_byte(files, tmp_path):
    ugly = record(trial=1, grasp=(np.array(record()["grasp"]) + 0.0).tolist())
    ugly["pose"][0][3] = 0.1 + 0.2  # 0.30000000000000004
    ugly["note"] = "kept"
    records = [record(attempt=3), ugly, record(attempt=1)]  # not in published order
    grasps, meshes = files(records)
    dataset = import_reach2019(grasps, meshes, MassRule({}))
    write_dataset(dataset, tmp_path / "d", ("parquet",))
    write_dataset(read_dataset(tmp_path / "d"), tmp_path / "out", ("reach2019",))
    written = tmp_path / "out" / "reach2019" / "block.json"
    assert written.read_bytes() == (grasps / "block.json").read_bytes()
    again = import_reach2019(written.parent, meshes, MassRule({}))
    assert [t.source_record for t in again.trials] == [t.source_record for t in dataset.trials]


def test_a_recorded_session_survives_the_published_form(make_dataset, tmp_path):
    dataset = make_dataset(objects=2, grasps=3, repeats=2)
    write_dataset(dataset, tmp_path / "a", ("parquet", "reach2019"))
    meshes = tmp_path / "meshes"
    meshes.mkdir()
    for part in dataset.objects.values():
        trimesh.Trimesh(part.vertices, part.faces).export(meshes / f"{part.name}.ply")
    back = import_reach2019(tmp_path / "a" / "reach2019", meshes, MassRule({}))
    assert back.simulated
    assert back.origin.startswith("Simulated trials")  # nobody judged them at a robot
    assert "person at the robot" not in back.success_rule
    assert len(back.trials) == len(dataset.trials)
    ours = {(t.object_name, t.attempt, t.repeat): t for t in dataset.trials}
    for trial in back.trials:
        mine = ours[trial.object_name, trial.attempt, trial.repeat]
        np.testing.assert_allclose(trial.T_object_gripper, mine.T_object_gripper, atol=1e-12)
        assert trial.label.success == mine.label.success
        assert trial.table_height == pytest.approx(mine.table_height, abs=1e-9)
    write_dataset(back, tmp_path / "b", ("reach2019",))
    for path in (tmp_path / "a" / "reach2019").iterdir():
        assert (tmp_path / "b" / "reach2019" / path.name).read_bytes() == path.read_bytes()


def test_nearly_orthonormal_rotations_are_projected_and_said(files):
    pose = np.array(record()["pose"])
    pose[:3, 0] *= 1.008
    dataset = read(files, [record(pose=pose.tolist()), record(attempt=1)])
    rotation = dataset.trials[0].T_world_object[:3, :3]
    np.testing.assert_allclose(rotation.T @ rotation, np.eye(3), atol=1e-12)
    assert "1 of 2 records have rotations up to 0.0161 off orthonormal" in dataset.notes[0]
    assert json.loads(dataset.trials[0].source_record)["pose"] == pose.tolist()


def scaled(key, factor):
    matrix = np.array(record()[key])
    matrix[:3, 0] *= factor
    return matrix.tolist()


def moved(key, meters):
    matrix = np.array(record()[key])
    matrix[0, 3] += meters
    return matrix.tolist()


def mirrored():
    matrix = np.array(record()["grasp"])
    matrix[:3, 0] *= -1
    return matrix.tolist()


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"pose": scaled("pose", 1.02)}, r"record 1: pose .*off orthonormal"),
        ({"grasp": mirrored()}, r"record 1: grasp mirrors"),
        ({"pose": np.eye(3).tolist()}, r"record 1: pose"),
        ({"grasp": [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 2]]}, r"last row"),
        ({"result": 1}, r"record 1: result"),
        ({"result": None}, r"record 1: result"),
        ({"attempt": -1}, r"record 1: attempt"),
        ({"attempt": True}, r"record 1: attempt"),
        ({"trial": 0.5}, r"record 1: trial"),
        ({"stable_pose": "3"}, r"record 1: stable_pose"),
        ({"obj": ""}, r"record 1: obj"),
        ({"attempt": 0, "trial": 0}, r"record 1 repeats record 0"),
        ({"pose": moved("pose", float("nan"))}, r"record 1: pose.0.3: Input should be a finite"),
        ({"tf": moved("pose", float("inf"))}, r"record 1: tf.0.3: Input should be a finite"),
        ({"note": float("nan")}, r"record 1 holds a value that is not finite"),
        ({"pose": moved("pose", 380.0)}, r"record 1: the hand is 380 m from the object"),
    ],
)
def test_what_does_not_fit_is_refused_with_its_number(files, changes, message):
    with pytest.raises(DatasetError, match=message):
        read(files, [record(), record(**({"trial": 1} | changes))])


@pytest.mark.parametrize(
    "key", ["obj", "pose", "grasp", "result", "stable_pose", "attempt", "trial"]
)
def test_missing_keys_are_refused(files, key):
    broken = record(trial=1)
    del broken[key]
    with pytest.raises(DatasetError, match=f"record 1: {key}"):
        read(files, [record(), broken])


@pytest.mark.parametrize("text", ["", "{}", "[]", "[1]", '[{"obj": "block", "pose": NaN}]'])
def test_files_that_hold_no_records_are_refused(files, text):
    grasps, meshes = files([record()])
    (grasps / "block.json").write_text(text)
    with pytest.raises(DatasetError, match=r"block\.json"):
        import_reach2019(grasps, meshes, MassRule({}))


def test_missing_folders_and_meshes_are_named(files, tmp_path):
    grasps, meshes = files([record(obj="cup")])
    with pytest.raises(UnknownNameError, match="'cup'; valid: block"):
        import_reach2019(grasps, meshes, MassRule({}))
    with pytest.raises(DatasetError, match="no folder of meshes"):
        import_reach2019(grasps, tmp_path / "absent", MassRule({}))
    with pytest.raises(DatasetError, match="no file or folder"):
        import_reach2019(tmp_path / "absent", meshes, MassRule({}))
    (tmp_path / "empty").mkdir()
    with pytest.raises(DatasetError, match=r"no \.json file"):
        import_reach2019(tmp_path / "empty", meshes, MassRule({}))


def test_an_open_mesh_is_refused(files):
    grasps, meshes = files([record()])
    mesh = trimesh.creation.icosphere(subdivisions=2, radius=0.01)
    mesh.update_faces(np.arange(len(mesh.faces)) > 40)
    mesh.export(meshes / "block.stl")
    with pytest.raises(InvalidMeshError, match="block"):
        import_reach2019(grasps, meshes, MassRule({}))


def test_masses_come_from_the_user_then_the_table_then_the_volume(files, tmp_path):
    records = [record(), record(obj="pear"), record(obj="mug")]
    grasps, meshes = files(records)
    for name in ("pear", "mug"):
        trimesh.creation.box((0.02, 0.02, 0.02)).export(meshes / f"{name}.stl")
    grams = grasps / "grams.json"
    grams.write_text('{"mug": 21.5}')
    rule = MassRule(read_masses(grams), density=1000.0, infill=0.5)
    dataset = import_reach2019(grasps, meshes, rule, ignore=[grams])
    mass = {name: part.mass for name, part in dataset.objects.items()}
    assert mass["mug"] == pytest.approx(0.0215)
    assert dataset.mass_sources["mug"] == "given with --masses"
    assert mass["pear"] == pytest.approx(0.0065)
    assert "published" in dataset.mass_sources["pear"]
    assert mass["block"] == pytest.approx(0.018**3 * 500)
    assert "infill 0.5" in dataset.mass_sources["block"]
    grams.write_text('{"mug": -1}')
    with pytest.raises(DatasetError, match="mass of 'mug' is -1"):
        read_masses(grams)


def test_different_grasps_under_one_attempt_are_not_mixed(files):
    moved = np.array(record()["grasp"])
    moved[0, 3] += 0.01
    dataset = read(files, [record(), record(trial=1, grasp=moved.tolist())])
    assert [t.grasp_id for t in dataset.trials] == ["block/00", "block/00-2"]
    assert "block/00" in dataset.notes[-1]


def test_published_trials(published, tmp_path):
    dataset = import_reach2019(published / "reach2019", published / "meshes", MassRule({}))
    assert len(dataset.trials) == 25 and dataset.successes == 16
    assert dataset.objects["cube_3cm"].mass == 0.003
    assert sorted({t.attempt for t in dataset.trials}) == [0, 3, 8, 10, 22]
    for trial in dataset.trials:
        # The gripper stands about 16 to 18 cm above the part, fingers toward it.
        to_part = -trial.T_object_gripper[:3, 3]
        assert 0.14 < np.linalg.norm(to_part) < 0.20
        assert trial.T_object_gripper[:3, 2] @ to_part > 0.13
    write_dataset(dataset, tmp_path / "d", ("parquet", "reach2019"))
    original = (published / "reach2019" / "cube_3cm.json").read_bytes()
    assert (tmp_path / "d" / "reach2019" / "cube_3cm.json").read_bytes() == original


def test_meshes_in_millimeters_are_read_and_folders_below_are_not_searched(files):
    grasps, meshes = files([record()])
    trimesh.creation.box((18, 18, 18)).export(meshes / "block.stl")
    with pytest.raises(InvalidMeshError, match="--mesh-unit mm"):
        import_reach2019(grasps, meshes, MassRule({}))
    read_in_mm = import_reach2019(grasps, meshes, MassRule({}), unit="mm").objects["block"]
    assert np.ptp(read_in_mm.vertices, axis=0) == pytest.approx([0.018] * 3)
    (meshes / "below").mkdir()
    (meshes / "block.stl").rename(meshes / "below" / "block.stl")
    with pytest.raises(UnknownNameError, match="no mesh in"):
        import_reach2019(grasps, meshes, MassRule({}), unit="mm")
