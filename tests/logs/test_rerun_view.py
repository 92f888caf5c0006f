"""The view is derived from record and annotations alone, at any time again."""

import os
import shutil
import subprocess
import sys
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest

from logs.annotation_files import write_annotation
from logs.annotations import LabelRecord, ScoreRecord
from logs.descriptions import robot_attachment
from logs.errors import RecordReadError, UnknownTrialError, ViewError
from logs.find_trial import find_take
from logs.index import list_takes
from logs.recorder import TrialRecorder
from logs.records import ExitStatus
from logs.rerun_view import derive_rrd, fresh_view, view_path
from logs.session import SessionFolder
from logs.session_overview import TIMELINES, overview
from logs.session_view import write_session_view
from logs.trial_record import read_record
from logs.view_colors import pressure_colors
from logs.view_object import object_track
from logs.view_text import summary
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


def test_a_blind_view_holds_no_prediction_and_no_verdict(take: Path) -> None:
    path = derive_rrd(take, blind=True)
    assert path == view_path(take, blind=True) and not view_path(take).exists()
    entities, text = read_view(path)
    assert "/world/object/mesh" in entities and "/images/color" in entities
    assert not any("contacts" in entity or "truth" in entity for entity in entities)
    for words in ("success", "0.81", "reach", "held", "sensors", "ada", "kPa"):
        assert words not in text.replace("reach-trials", "").replace("held: width", ""), words
    assert b"contacts" not in path.read_bytes()


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
    command = [sys.executable, "-m", "rerun_cli", "rrd", "verify", str(derive_rrd(take))]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr


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
    monkeypatch.setattr("logs.view_file.shutil.disk_usage", lambda folder: usage)
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


# ---- the session -----------------------------------------------------------------------------


@pytest.fixture(scope="module")
def session(sessions, tmp_path_factory) -> SessionFolder:
    return sessions.build_session(tmp_path_factory.mktemp("s") / "session", 5, samples=3)


def test_disagreements_come_first(session: SessionFolder) -> None:
    shown = overview(list_takes(session.path))
    gaps = [item.disagreement for item in shown]
    assert gaps == sorted(gaps, reverse=True) and shown[0].wrong and not shown[-1].wrong
    assert [item.places["disagreement"] for item in shown] == [1, 2, 3, 4, 5]
    for timeline in TIMELINES:
        assert sorted(item.places[timeline] for item in shown) == [1, 2, 3, 4, 5]
    by_outcome = sorted(shown, key=lambda item: item.places["by_outcome"])
    assert [item.row.outcome for item in by_outcome] == ["failure"] + ["success"] * 4


def test_all_trials_are_in_one_recording(session: SessionFolder, tmp_path: Path) -> None:
    from rerun.chunk import RrdReader

    path = write_session_view(session.path, tmp_path / "all.rrd")
    entities, text = read_view(path)
    assert {
        "/scene/objects/cube_3cm",
        "/scene/objects/bracket",
        "/scene/hand",
        "/picture",
    } <= entities
    for number in range(1, 6):
        assert f"{number:04d} " in text and f"Trial {number}:" in text
    assert text.count("disagrees: ") == sum(
        item.wrong for item in overview(list_takes(session.path))
    )
    steps = {
        name: set(batch.column(name).to_pylist())
        for chunk in RrdReader(str(path)).stream()
        if str(chunk.entity_path) == "/summary"
        for batch in [chunk.to_record_batch()]
        for name in TIMELINES
    }
    assert all(found == {1, 2, 3, 4, 5} for found in steps.values()) and len(steps) == 4


def test_a_session_without_trials_says_so(sessions, tmp_path: Path) -> None:
    folder = sessions.make_session(tmp_path / "s", 2)
    with pytest.raises(ViewError, match="no executed trial"):
        write_session_view(folder.path, tmp_path / "all.rrd")


def test_a_trial_is_found_by_number_id_and_beginning(session: SessionFolder) -> None:
    second = session.descriptor.trials[1].trial_id
    expected = session.trial_folder(second)
    assert find_take(session.path, "2") == expected
    assert find_take(session.path, second) == expected
    assert find_take(session.path, second[:13]) == expected


@pytest.mark.parametrize("wanted", ["99", "", "zzz", "0"])
def test_an_unknown_trial_is_one_clear_error(session: SessionFolder, wanted: str) -> None:
    with pytest.raises(UnknownTrialError, match=r"valid: a number from 1 to 6") as raised:
        find_take(session.path, wanted)
    assert "\n" not in str(raised.value)


def test_a_trial_without_record_is_one_clear_error(session: SessionFolder) -> None:
    with pytest.raises(UnknownTrialError, match="trial 6 .* has no record yet"):
        find_take(session.path, "6")


def test_replay_rebuilds_all_views(session: SessionFolder, tmp_path: Path, capsys) -> None:
    from collection.cli.replay import replay

    for path in session.path.rglob("*.rrd"):
        path.unlink()
    replay(session.path, save=tmp_path / "out.rrd", no_viewer=True)
    assert capsys.readouterr().out.strip() == str(tmp_path / "out.rrd")
    assert (tmp_path / "out.rrd").stat().st_size > 10_000
    assert len(list(session.path.glob("trials/*/trial.rrd"))) == 5
    replay(session.path, trial="3", blind=True, no_viewer=True)
    shown = Path(capsys.readouterr().out.strip())
    assert shown.name == "trial.blind.rrd" and shown.parent.name.startswith("0003_")


def test_replay_refuses_what_makes_no_sense(
    session: SessionFolder, tmp_path: Path, monkeypatch
) -> None:
    from collection.cli.replay import replay

    with pytest.raises(ViewError, match="--trial"):
        replay(session.path, blind=True, no_viewer=True)
    with pytest.raises(ViewError, match=r"ends in \.rrd"):
        replay(session.path, trial="1", save=tmp_path / "out.mp4", no_viewer=True)
    monkeypatch.delenv("DISPLAY", raising=False)
    monkeypatch.delenv("WAYLAND_DISPLAY", raising=False)
    with pytest.raises(ViewError, match="no screen"):
        replay(session.path, trial="1")


def test_free_text_cannot_break_the_panel(made, tmp_path: Path) -> None:
    from logs.annotations import Annotations

    with TrialRecorder(tmp_path) as recorder:
        recorder.start(made.descriptor(made.cube()))
        recorder.stop(ExitStatus.FAIL, "| broken\n# not a title <b>")
    text = summary(read_record(tmp_path), Annotations(), blind=False)
    assert "\\| broken \\# not a title \\<b\\>" in text
