"""The view is derived from record and annotations alone, at any time again."""

import json
import os
import shutil
import subprocess
from dataclasses import replace
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest

from logs.errors import RecordReadError, ViewError
from logs.record.annotation_files import write_annotation
from logs.record.annotations import LabelRecord, ScoreRecord
from logs.record.descriptions import robot_attachment
from logs.record.recorder import TrialRecorder
from logs.record.records import ExitStatus
from logs.record.streams import JawTrack
from logs.record.trial_record import read_record
from logs.view.colors import pressure_colors
from logs.view.eyes import turned_to_hand
from logs.view.object import object_track
from logs.view.text import summary
from logs.view.trial import derive_rrd, fresh_view, view_path
from logs.view.viewer import viewer_program
from reach.transforms import exp


@pytest.fixture
def take(made: ModuleType, tmp_path: Path) -> Path:
    """A recorded, labeled and scored take."""
    folder = tmp_path / "take"
    with TrialRecorder(folder) as recorder:
        made.record_trial(recorder, samples=12)
    write_annotation(folder, label(made, 12, "success"))
    write_annotation(folder, score(made, 13, "reach", 0.81))
    write_annotation(folder, score(made, 14, "point", 0.2))
    return folder


def label(made: ModuleType, revision: int, outcome: str) -> LabelRecord:
    time_ns = made.START_NS + revision
    return LabelRecord(
        made.TRIAL_ID, 1, time_ns, str(revision), revision, outcome, operator="ada", note="a *star*"
    )


def score(made: ModuleType, revision: int, model: str, value: float) -> ScoreRecord:
    patches = made.patches() if model == "reach" else ()
    return ScoreRecord(
        made.TRIAL_ID, 1, made.START_NS, str(revision), revision, model, "1", value,
        parameters={"friction": "0.5"}, explanation="resists the pull", patches=patches,
    )  # fmt: skip


def read_view(path: Path) -> tuple[set[str], str]:
    """Entities of a view, and all its text."""
    from rerun.chunk import RrdReader

    entities, words = set(), []
    for chunk in RrdReader(str(path)).stream():
        entities.add(str(chunk.entity_path))
        batch = chunk.to_record_batch()
        words += [str(batch.column(i).to_pylist()) for i in range(batch.num_columns)
                  if "Text" in batch.schema.field(i).name]  # fmt: skip
    return entities, "\n".join(words)


def test_everything_of_the_trial_is_shown(take: Path) -> None:
    entities, text = read_view(derive_rrd(take))
    expected = {
        "/world/table", "/world/object/mesh", "/world/object/contacts/shown/jaw_0_0/pressure",
        "/world/object/contacts/shown/jaw_1_1/force", "/world/hand", "/world/hand/jaw_0/pad",
        "/world/robot/base/cylinder_0", "/world/robot/wrist", "/world/planned_pads",
        "/world/cameras/depth", "/world/cloud", "/world/rivals/0", "/images/depth/depth",
        "/images/color", "/plots/width", "/plots/force", "/plots/joints/joint_1", "/events",
        "/phase", "/summary",
    }  # fmt: skip
    assert expected <= entities, expected - entities
    for words in ("success", "ada", "a \\*star", "0.81", "**disagrees**", "78 kPa", "fitness 0.97"):
        assert words in text.replace("\\\\", "\\"), words


def ghosts(view: Path) -> dict[str, list[tuple[float, np.ndarray]]]:
    """Per entity of the predicted settling: when it appears [s], and its points or place (N, 3)."""
    from rerun.chunk import RrdReader

    found: dict[str, list[tuple[float, np.ndarray]]] = {}
    for chunk in RrdReader(str(view)).stream():
        entity, batch = str(chunk.entity_path), chunk.to_record_batch()
        for column in ("LineStrips3D:strips", "Transform3D:translation"):
            if "predicted_settling" in entity and column in batch.schema.names:
                when = batch.column("elapsed")[0].as_py().total_seconds()
                places = np.array(batch.column(column)[0].as_py()).reshape(-1, 3)
                found.setdefault(entity, []).append((when, places))
    return found


def settled_score(made: ModuleType, path: object) -> ScoreRecord:
    return ScoreRecord(
        made.TRIAL_ID, 1, made.START_NS, "30", 30, "settled", "1", 1.0,
        texts={"path": json.dumps(path), "explanation": '"settles by 20 mm"'},
    )  # fmt: skip


def test_ghosts_show_how_the_part_settles_once_the_jaws_close(made, take: Path) -> None:
    write_annotation(take, settled_score(made, made.settling()))
    drawn = ghosts(derive_rrd(take))
    assert set(drawn) == {
        "/world/predicted_settling/settled/way",
        "/world/predicted_settling/settled/settled",
    }
    record = read_record(take)
    closing = (record.execution.time_ns - record.descriptor.time_ns) / 1e9
    ((when, way),) = drawn["/world/predicted_settling/settled/way"]
    ((_, settled),) = drawn["/world/predicted_settling/settled/settled"]
    edges = 24  # ends of a box's edges
    assert when == pytest.approx(closing) and len(way) % edges == 0
    way = way.reshape(-1, edges, 3).mean(axis=1)
    assert 3 <= len(way) <= 5
    assert np.allclose(settled, [np.array(made.settling())[-1, :3, 3]], atol=1e-6)
    assert np.all(np.diff(way[:, 1]) > 0.003)  # apart from one another, along the way
    assert "settles by 20 mm" in read_view(derive_rrd(take))[1]


@pytest.mark.parametrize("path", [[], [[1.0, 2.0]], "north", [np.eye(3).tolist()], {"a": 1}])
def test_a_path_that_is_none_draws_no_ghost(made, take: Path, path: object) -> None:
    write_annotation(take, settled_score(made, path))
    assert ghosts(derive_rrd(take)) == {}


def test_a_part_that_stays_where_it_is_has_no_ghost(made, take: Path) -> None:
    write_annotation(take, settled_score(made, made.settling(way=0.0003, steps=1) * 12))
    assert ghosts(derive_rrd(take)) == {}


def test_the_eye_sees_the_hand_from_before_it(made) -> None:
    """However the hand stands, it closes along x, and is beyond the object or above it."""
    randomly = np.random.default_rng(3)
    for _ in range(50):
        T_world_gripper = exp(randomly.normal(size=6))
        turned = turned_to_hand(T_world_gripper) @ T_world_gripper[:3, :3]
        assert abs(turned[1, 0]) < 1e-9 and turned[1, 2] <= 1e-9
    upright = np.diag([1.0, -1.0, -1.0, 1.0])  # from above: the robot's side decides
    assert np.allclose(turned_to_hand(upright, np.array([0.0, 1.0])), np.eye(3))
    assert np.allclose(turned_to_hand(upright, np.array([0.0, -1.0])), np.diag([-1, -1, 1]))
    sideways = exp([0, np.pi / 2, 0, 0, 0, 0])  # closes along the vertical
    assert np.allclose(turned_to_hand(sideways), turned_to_hand(sideways).round())


def test_a_blind_view_holds_no_prediction_and_no_verdict(made, take: Path) -> None:
    write_annotation(take, settled_score(made, made.settling()))
    path = derive_rrd(take, blind=True)
    assert path == view_path(take, blind=True) and not view_path(take).exists()
    entities, text = read_view(path)
    assert "/world/object/mesh" in entities and "/images/color" in entities
    assert not any("contacts" in entity or "truth" in entity for entity in entities)
    for words in ("success", "0.81", "reach", "held", "sensors", "ada", "kPa"):
        assert words not in text.replace("reach-trials", "").replace("held: width", ""), words
    assert b"contacts" not in path.read_bytes() and b"settling" not in path.read_bytes()


def test_the_record_is_never_touched_and_views_are_rebuilt(made, take: Path) -> None:
    record = (take / "trial.mcap").read_bytes()
    path = fresh_view(take)
    made_at = path.stat().st_ino
    assert fresh_view(take).stat().st_ino == made_at
    path.unlink()
    assert fresh_view(take).exists()
    write_annotation(take, label(made, 20, "failure"))
    assert "failure" in read_view(fresh_view(take))[1]
    assert (take / "trial.mcap").read_bytes() == record
    assert sorted(p.suffix for p in take.iterdir()) == [".mcap"] * 5 + [".rrd"]


def test_a_copied_take_s_view_is_not_trusted_blindly(take: Path, tmp_path: Path) -> None:
    """Copying may mix up the files' times; then the view is derived anew."""
    fresh_view(take)
    copied = tmp_path / "copied"
    shutil.copytree(take, copied, copy_function=shutil.copyfile)
    os.utime(copied / "trial.rrd", ns=(2 * 10**18, 2 * 10**18))  # newer than its sources
    before = (copied / "trial.rrd").stat().st_ino
    assert fresh_view(copied).stat().st_ino != before


def test_rerun_accepts_the_file(take: Path) -> None:
    view = derive_rrd(take)
    command = [viewer_program(), "rrd", "verify", str(view)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    view.write_bytes(view.read_bytes()[:-500])
    assert subprocess.run(command, capture_output=True, check=False).returncode != 0


def test_a_record_with_nothing_but_its_start_is_shown(made, tmp_path: Path) -> None:
    with TrialRecorder(tmp_path / "t") as recorder:
        recorder.start(made.descriptor(made.cube()))
    entities, text = read_view(derive_rrd(tmp_path / "t"))
    assert "/summary" in entities and "without a stop" in text


def test_a_cut_record_is_shown_as_such(take: Path) -> None:
    record = take / "trial.mcap"
    record.write_bytes(record.read_bytes()[:40_000])
    assert "Damaged record" in read_view(derive_rrd(take))[1]
    record.write_bytes(b"")
    with pytest.raises(RecordReadError):
        derive_rrd(take)


def test_an_unwritable_place_is_one_clear_error(take: Path) -> None:
    with pytest.raises(ViewError, match="cannot write the view"):
        derive_rrd(take, take / "missing" / "out.rrd")


def test_a_full_disk_is_refused_before_anything_is_written(take: Path, monkeypatch) -> None:
    usage = shutil.disk_usage(take)._replace(free=10 * 2**20)
    monkeypatch.setattr("logs.view.file.shutil.disk_usage", lambda folder: usage)
    with pytest.raises(ViewError, match="10 MB left; is the disk full"):
        derive_rrd(take)
    assert [path for path in take.iterdir() if path.suffix != ".mcap"] == []


def test_the_object_stands_where_it_was_found_and_is_then_carried(made, take: Path) -> None:
    record = read_record(take)
    times, poses = object_track(record)
    assert np.array_equal(poses[0], made.T_world_object())
    carried = times >= record.execution.time_ns
    assert carried.sum() >= 5
    heights = poses[carried][:, 2, 3]
    assert heights[-1] - heights[0] > 0.05  # it rises with the hand
    gripper = record.frames["gripper"].transforms()[-1]
    held = gripper @ np.linalg.inv(record.execution.executed.T_object_gripper)
    assert np.allclose(poses[-1], held)


def test_an_object_that_was_put_down_stays_there(made, take: Path) -> None:
    """The jaws close only after the grasp's time, hold, and open before the hand leaves."""
    record = read_record(take)
    begun, track = record.execution.time_ns, record.frames["gripper"]
    steps = track.time_ns[track.time_ns >= begun]
    widths = np.full(len(steps), 0.05)
    widths[1:-2] = 0.03
    record = replace(record, jaw=JawTrack(steps, widths, np.zeros(len(steps))))
    times, poses = object_track(record)
    assert times[-1] == steps[-2] < track.time_ns[-1]
    left = track.transforms()[track.time_ns == steps[-2]][0]
    T_gripper_object = np.linalg.inv(record.execution.executed.T_object_gripper)
    assert np.allclose(poses[-1], left @ T_gripper_object)


def test_frames_are_drawn_where_the_record_says(made, tmp_path: Path) -> None:
    """A rotation whose inverse is another one: a transposed matrix would be noticed."""
    from rerun.chunk import RrdReader

    T = exp([0.3, -0.5, 0.8, 0.1, 0.2, 0.3])
    with TrialRecorder(tmp_path) as recorder:
        recorder.start(made.descriptor(made.cube()), [robot_attachment(made.robot())])
        recorder.frames(made.START_NS + 5, {"wrist": T})
        recorder.stop(ExitStatus.SUCCESS)
    (batch,) = (
        chunk.to_record_batch()
        for chunk in RrdReader(str(derive_rrd(tmp_path))).stream()
        if str(chunk.entity_path) == "/world/robot/wrist"
    )
    columns = batch.column("Transform3D:mat3x3")[-1].as_py()[0]
    assert np.allclose(np.reshape(columns, (3, 3)).T, T[:3, :3], atol=1e-6)
    assert np.allclose(batch.column("Transform3D:translation")[-1].as_py()[0], T[:3, 3], atol=1e-6)


def test_the_pressure_scale_rises_from_violet_to_yellow() -> None:
    shades = pressure_colors(np.array([0.0, 0.5, 1.0, 2.0]), 1.0)
    assert shades.tolist()[0] == [13, 8, 135] and shades.tolist()[2:] == [[240, 249, 33]] * 2
    luminance = pressure_colors(np.linspace(0, 1, 50), 1.0) @ [0.2126, 0.7152, 0.0722]
    assert np.all(np.diff(luminance) >= -1)
    assert pressure_colors(np.zeros((2, 3)), 0.0).shape == (2, 3, 3)


def test_free_text_cannot_break_the_panel(made, tmp_path: Path) -> None:
    from logs.record.annotations import Annotations

    with TrialRecorder(tmp_path) as recorder:
        recorder.start(made.descriptor(made.cube()))
        recorder.stop(ExitStatus.FAIL, "| broken\n# not a title <b>")
    text = summary(read_record(tmp_path), Annotations(), blind=False)
    assert "\\| broken \\# not a title \\<b\\>" in text
