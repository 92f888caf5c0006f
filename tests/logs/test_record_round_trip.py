"""What goes into a record comes out, exactly."""

from pathlib import Path

import numpy as np
import pytest

from logs.errors import RecordReadError, RecordWriteError, UnknownFormatError
from logs.record.annotation_files import read_annotations, write_annotation
from logs.record.annotations import ALL_LABELS, LabelRecord, ScoreRecord
from logs.record.descriptions import (
    GRIPPER_DESCRIPTION,
    ROBOT_DESCRIPTION,
    read_gripper,
    read_robot,
)
from logs.record.mesh_attachment import OBJECT_MESH, read_mesh
from logs.record.recorder import TrialRecorder
from logs.record.records import ExitStatus, RegistrationRecord, TrialDescriptor
from logs.record.streams import CloudRecord, DepthImage
from logs.record.trial_record import TrialRecord, read_record
from reach.errors import InvalidInputError
from reach.gripper import ParallelJawGripper
from reach.objects import GraspObject


@pytest.fixture(scope="module")
def record(made, tmp_path_factory) -> TrialRecord:
    folder = tmp_path_factory.mktemp("take")
    with TrialRecorder(folder) as recorder:
        made.record_trial(recorder, samples=20)
    return read_record(folder)


def same(a: object, b: object) -> bool:
    """Whether two records are equal, arrays bit for bit."""
    if isinstance(a, np.ndarray):
        return np.array_equal(a, b, equal_nan=True)
    if hasattr(a, "__slots__") and not isinstance(a, str):
        return type(a) is type(b) and all(same(getattr(a, n), getattr(b, n)) for n in a.__slots__)
    if isinstance(a, tuple):
        return isinstance(b, tuple) and len(a) == len(b) and all(map(same, a, b))
    return a == b


def test_descriptor_and_results_are_exact(made, record: TrialRecord) -> None:
    assert same(record.descriptor, made.descriptor(made.cube()))
    assert same(record.registration, made.registration())
    assert same(record.execution, made.execution())


def test_a_complete_record_says_so(record: TrialRecord) -> None:
    assert record.complete and record.executed and record.damage is None
    assert record.stop is not None
    assert sum(record.stop.message_counts.values()) == record.message_count - 1
    assert [phase.name for phase in record.phases] == ["capture", "register", "execute", "close"]
    assert record.gaps == ()


def test_depth_is_bit_exact_with_its_holes(made, record: TrialRecord) -> None:
    view = made.camera()
    expected = made.depth_of(view, made.cube())
    assert np.isnan(expected).any()
    assert np.array_equal(record.depth[0].meters(), expected, equal_nan=True)
    assert record.depth[0].time_ns == made.START_NS + 800 * made.MS
    found = record.cameras["depth"]
    assert (found.fx, found.cx, found.width) == (view.fx, view.cx, view.width)
    assert found.sensor == "structured-light"
    assert np.allclose(found.T_world_camera, view.T_world_camera, atol=1e-15)


def test_millimeter_depth_and_clouds(made, tmp_path: Path) -> None:
    millimeters = np.array([[0, 500], [65535, 1]], np.uint16)
    points = np.array([[0.1, 0.2, 0.3], [np.nan, 0, 1]], np.float32)
    with TrialRecorder(tmp_path / "t") as recorder:
        recorder.start(made.descriptor(made.cube()))
        recorder.depth(DepthImage(5, millimeters))
        recorder.cloud(CloudRecord(6, points))
        recorder.stop(ExitStatus.SUCCESS)
    record = read_record(tmp_path / "t")
    assert record.depth[0].depth.dtype == np.uint16
    expected = np.array([[np.nan, 0.5], [65.535, 0.001]], np.float32)
    assert np.allclose(record.depth[0].meters(), expected, equal_nan=True)
    assert np.array_equal(record.clouds[0].points_camera, points, equal_nan=True)


def test_tracks(made, record: TrialRecord) -> None:
    (joints,) = record.joints
    assert joints.names == tuple(f"joint_{k}" for k in range(1, 8))
    assert joints.positions.shape == (20, 7)
    assert np.allclose(joints.positions[:, 2], 0.2 + np.linspace(0, 1, 20))
    assert np.isnan(joints.velocities).all() and np.isnan(joints.efforts).all()
    assert np.all(np.diff(record.jaw.time_ns) > 0)
    assert record.jaw.widths[0] == 0.05 and record.jaw.forces[-1] == 20.0
    gripper = record.frames["gripper"].transforms()
    expected = made.T_world_object() @ made.T_object_gripper()
    assert np.allclose(gripper[0][:3, :3], expected[:3, :3], atol=1e-15)
    assert np.allclose(gripper[0][:3, 3], expected[:3, 3] + (0, 0, 0.25))


def test_colors_survive_compression(made, record: TrialRecord) -> None:
    depth = made.depth_of(made.camera(), made.cube())
    error = record.color[0].pixels().astype(float) - made.color_of(depth)
    assert np.abs(error).mean() < 6


def test_attachments_are_exact(made, record: TrialRecord) -> None:
    obj = made.cube()
    vertices, faces = read_mesh(record.attachments[OBJECT_MESH].data)
    again = GraspObject(obj.name, vertices, faces, obj.mass)
    assert again.content_hash == record.descriptor.object_hash
    assert read_robot(record.attachments[ROBOT_DESCRIPTION].data) == made.robot()
    yumi, read = (
        ParallelJawGripper.yumi(),
        read_gripper(record.attachments[GRIPPER_DESCRIPTION].data),
    )
    assert read.name == yumi.name and read.stroke == yumi.stroke
    for jaw, other in zip(yumi.jaws, read.jaws, strict=True):
        assert np.array_equal(jaw.pad.polygon, other.pad.polygon)
        assert np.array_equal(jaw.T_gripper_pad_open, other.T_gripper_pad_open)
        assert len(jaw.boxes) == len(other.boxes)


def test_other_tools_read_the_mesh(made, record: TrialRecord, tmp_path: Path) -> None:
    import trimesh

    path = tmp_path / "object.ply"
    path.write_bytes(record.attachments[OBJECT_MESH].data)
    mesh = trimesh.load_mesh(path)
    assert mesh.is_watertight
    assert mesh.volume == pytest.approx(made.cube().volume)


def test_without_images_nothing_else_is_missing(record: TrialRecord) -> None:
    light = read_record(record.path, images=False)
    assert light.depth == () and light.color == ()
    assert light.complete and light.message_count == record.message_count
    assert same(light.registration, record.registration)
    assert same(light.cameras["depth"], record.cameras["depth"])


def test_annotations_keep_every_revision(made, tmp_path: Path) -> None:
    def label(revision: int, **what: object) -> LabelRecord:
        return LabelRecord(made.TRIAL_ID, 1, 1000 + revision, str(revision), revision, **what)

    def outcome() -> str | None:
        found = read_annotations(tmp_path).label
        return found.outcome if found else None

    score = ScoreRecord(
        made.TRIAL_ID, 1, 5, "5", 5, "reach", "1.0", 0.25, 0.02, {"friction": "0.5"}, "slips",
        {"margin": -0.1}, {"reason": '"slip"'}, made.patches(),
    )  # fmt: skip
    write_annotation(tmp_path, label(4, outcome="success", operator="ada"))
    write_annotation(tmp_path, score)
    assert outcome() == "success"
    write_annotation(tmp_path, label(6, outcome="failure", reason="missed"))
    assert outcome() == "failure"
    write_annotation(tmp_path, label(7, outcome="success", operator="bob", second=True))
    assert outcome() == "failure"
    write_annotation(tmp_path, label(8, withdraws="6"))
    assert outcome() == "success"
    write_annotation(tmp_path, label(9, withdraws=ALL_LABELS))
    assert outcome() is None
    found = read_annotations(tmp_path)
    assert len(list(tmp_path.iterdir())) == 6 and found.damaged == ()
    assert same(found.newest_scores["reach"], score)


def test_an_annotation_needs_its_folder(made, tmp_path: Path) -> None:
    with pytest.raises(RecordWriteError, match="no take's folder"):
        write_annotation(tmp_path / "gone", LabelRecord(made.TRIAL_ID, 1, 1, "1", 1))


def test_a_later_format_is_refused_by_name(made, tmp_path: Path, monkeypatch) -> None:
    monkeypatch.setattr("logs.record.encode.FORMAT_VERSION", 99)
    with TrialRecorder(tmp_path / "t") as recorder:
        made.record_trial(recorder, samples=1)
    with pytest.raises(UnknownFormatError, match="record format 99; this release reads 1"):
        read_record(tmp_path / "t")


def test_other_files_are_no_records(tmp_path: Path) -> None:
    other = tmp_path / "notes.mcap"
    other.write_text("shopping list")
    with pytest.raises(RecordReadError, match="no start message"):
        read_record(other)
    with pytest.raises(RecordReadError, match="holds no record"):
        read_record(tmp_path)
    with pytest.raises(RecordReadError, match="cannot read"):
        read_record(tmp_path / "missing.mcap")


def test_records_refuse_what_is_no_number(made) -> None:
    good = made.registration()
    with pytest.raises(InvalidInputError, match="covariance"):
        RegistrationRecord(
            good.time_ns, good.T_world_object, good.T_camera_object, np.full((6, 6), np.nan)
        )
    with pytest.raises(InvalidInputError, match="T_world_object"):
        described = made.descriptor(made.cube())
        TrialDescriptor(
            **{name: getattr(described, name) for name in described.__slots__}
            | {"T_world_object": np.ones((4, 4))}
        )


def test_the_first_release_s_record_is_read(made, fixtures: Path) -> None:
    """`record_v1` was written by the first release; it never changes."""
    record = read_record(fixtures / "record_v1" / "trial.mcap")
    assert record.complete and record.format_version == 1
    assert record.descriptor.trial_id == "3f0c8a52-6a41-4b52-9d36-0c0ffee00007"
    assert (record.descriptor.number, record.descriptor.object_name) == (7, "cube_3cm")
    assert record.message_count == 67
    assert record.depth[0].depth.shape == (48, 64)
    assert record.depth[0].meters()[24, 32] == np.float32(0.6264545917510986)
    assert record.registration is not None and record.execution is not None
    assert record.registration.quality["fitness"] == 0.97
    assert record.registration.covariance[2, 2] == 4e-4
    assert record.execution.executed.T_object_gripper[2, 3] == pytest.approx(0.165)
    assert record.execution.sensor_verdict == "held"
    assert record.jaw.widths.shape == (12,) and record.joints[0].positions.shape == (12, 7)
    assert sorted(record.attachments) == ["gripper.json", "object.ply", "robot.json"]
    annotations = read_annotations(fixtures / "record_v1")
    assert annotations.label is not None and annotations.label.outcome == "success"
    assert annotations.newest_scores["reach"].value == 0.81
    assert len(annotations.newest_scores["reach"].patches) == 2
