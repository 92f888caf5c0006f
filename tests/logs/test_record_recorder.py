"""The recorder never makes the trial wait, never hides a loss, and leaves a proper file."""

import threading
from pathlib import Path

import numpy as np
import pytest

from logs.errors import RecordWriteError
from logs.record import mcap_file
from logs.record.recorder import TrialRecorder
from logs.record.records import EventKind, ExitStatus, TrialEvent
from logs.record.streams import DepthImage
from logs.record.trial_record import read_record
from logs.trial_folder import PART_NAME, RECORD_NAME


@pytest.fixture
def stalled(monkeypatch):
    """A disk that does not answer until the returned event is set; it fails whoever waits."""
    answer = threading.Event()
    real = mcap_file.DurableMcap.flush

    def flush(self) -> None:
        assert answer.wait(60)
        real(self)

    monkeypatch.setattr(mcap_file.DurableMcap, "flush", flush)
    yield answer
    answer.set()


def test_the_file_has_its_name_only_when_finished(made, tmp_path: Path) -> None:
    recorder = TrialRecorder(tmp_path)
    recorder.start(made.descriptor(made.cube()))
    recorder.flush()
    assert (tmp_path / PART_NAME).exists() and not (tmp_path / RECORD_NAME).exists()
    assert read_record(tmp_path).stop is None
    assert recorder.stop(ExitStatus.SUCCESS) == tmp_path / RECORD_NAME
    assert not (tmp_path / PART_NAME).exists()
    assert read_record(tmp_path).complete


def test_what_a_flush_confirmed_is_readable_at_once(made, tmp_path: Path) -> None:
    with TrialRecorder(tmp_path) as recorder:
        recorder.start(made.descriptor(made.cube()))
        for i in range(5):
            recorder.jaw(1000 + i, 0.01 * i)
            recorder.flush()
            assert read_record(tmp_path).jaw.widths.tolist() == [0.01 * k for k in range(i + 1)]


def test_a_stalled_disk_stops_no_motion(made, tmp_path: Path, stalled: threading.Event) -> None:
    recorder = TrialRecorder(tmp_path)
    depth = made.depth_of(made.camera(640, 480), made.cube())
    recorder.start(made.descriptor(made.cube()))
    recorder.phase("execute")
    recorder.depth(DepthImage(1, depth))
    for i in range(200):
        recorder.jaw(i, 0.02)
    recorder.registration(made.registration())
    stalled.set()  # not before all calls returned: one that waited for the disk would never
    recorder.stop(ExitStatus.SUCCESS)
    assert len(read_record(tmp_path).jaw.widths) == 200


def test_a_full_backlog_drops_samples_and_says_how_many(
    made, tmp_path: Path, stalled: threading.Event
) -> None:
    recorder = TrialRecorder(tmp_path, backlog_limit=100 * 1024)
    recorder.start(made.descriptor(made.cube()))
    for i in range(1000):
        recorder.jaw(i, 0.02)
    recorder.execution(made.execution())
    stalled.set()
    recorder.stop(ExitStatus.SUCCESS)
    record = read_record(tmp_path)
    (gap,) = record.gaps
    assert 0 < len(record.jaw.widths) < 1000
    assert int(gap.data["missing"]) == 1000 - len(record.jaw.widths)
    assert gap.data["topic"] == "/gripper/jaw"
    assert record.execution is not None  # results are never dropped
    assert record.complete


def test_a_jump_of_a_device_s_counter_is_a_gap(made, tmp_path: Path) -> None:
    with TrialRecorder(tmp_path) as recorder:
        recorder.start(made.descriptor(made.cube()))
        for sequence in (4, 5, 9, 10):
            recorder.jaw(sequence, 0.02, sequence=sequence)
        recorder.joints(1, ["a"], [0.1], sequence=7)
        recorder.stop(ExitStatus.SUCCESS)
    (gap,) = read_record(tmp_path).gaps
    assert gap.kind is EventKind.GAP and gap.data == {"topic": "/gripper/jaw", "missing": "3"}
    assert "from 5 to 9" in gap.message


def test_arrays_may_change_after_they_were_handed_over(
    made, tmp_path: Path, stalled: threading.Event
) -> None:
    depth, pose = np.full((4, 4), 0.5, np.float32), np.eye(4)
    recorder = TrialRecorder(tmp_path)
    recorder.start(made.descriptor(made.cube()))
    recorder.depth(DepthImage(1, depth))
    recorder.frames(1, {"gripper": pose})
    depth[:], pose[0, 3] = 9.0, 9.0
    stalled.set()
    recorder.stop(ExitStatus.SUCCESS)
    record = read_record(tmp_path)
    assert (record.depth[0].meters() == 0.5).all()
    assert record.frames["gripper"].translations[0, 0] == 0.0


def test_a_failing_disk_is_told_at_the_next_safe_point(made, tmp_path: Path, monkeypatch) -> None:
    recorder = TrialRecorder(tmp_path)
    recorder.start(made.descriptor(made.cube()))
    recorder.flush()

    def fail(self) -> None:
        raise OSError(28, "No space left on device")

    with monkeypatch.context() as patched:
        patched.setattr(mcap_file.DurableMcap, "flush", fail)
        with pytest.raises(RecordWriteError, match="No space left"):
            recorder.flush()
    recorder.jaw(1, 0.02)  # within a motion: silent
    recorder.joints(1, ["a"], [0.0])
    for safe_point in (
        lambda: recorder.phase("lift"),
        lambda: recorder.execution(made.execution()),
        lambda: recorder.event(TrialEvent(1, EventKind.ROBOT, "held")),
        lambda: recorder.stop(ExitStatus.SUCCESS),
    ):
        with pytest.raises(RecordWriteError, match="No space left"):
            safe_point()
    assert not (tmp_path / RECORD_NAME).exists()
    assert read_record(tmp_path).descriptor.trial_id == made.TRIAL_ID


def test_an_exception_in_the_trial_is_the_reason_of_the_abort(made, tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="arm is cold"), TrialRecorder(tmp_path) as recorder:
        recorder.start(made.descriptor(made.cube()))
        raise ValueError("arm is cold")
    stop = read_record(tmp_path).stop
    assert stop is not None
    assert (stop.exit_status, stop.reason) == (ExitStatus.ABORT, "ValueError: arm is cold")


def test_leaving_without_a_stop_is_an_abort(made, tmp_path: Path) -> None:
    with TrialRecorder(tmp_path) as recorder:
        recorder.start(made.descriptor(made.cube()))
    record = read_record(tmp_path)
    assert record.stop is not None and record.stop.exit_status is ExitStatus.ABORT
    assert not record.executed


def test_nothing_is_overwritten(made, tmp_path: Path) -> None:
    with TrialRecorder(tmp_path) as recorder:
        recorder.start(made.descriptor(made.cube()))
        with pytest.raises(RecordWriteError, match="reach recover"):
            TrialRecorder(tmp_path)
        recorder.stop(ExitStatus.SUCCESS)
    content = (tmp_path / RECORD_NAME).read_bytes()
    with pytest.raises(RecordWriteError, match="never rewritten"):
        TrialRecorder(tmp_path)
    with pytest.raises(RecordWriteError, match="takes no more"):
        recorder.phase("again")
    with pytest.raises(RecordWriteError, match="takes no more"):
        recorder.stop(ExitStatus.FAIL)
    assert (tmp_path / RECORD_NAME).read_bytes() == content


def test_capture_and_receipt_are_two_times(made, tmp_path: Path) -> None:
    from mcap.reader import make_reader

    with TrialRecorder(tmp_path, now=lambda: 77) as recorder:
        recorder.start(made.descriptor(made.cube()))
        recorder.jaw(5, 0.02)
        path = recorder.stop(ExitStatus.SUCCESS)
    with path.open("rb") as stream:
        messages = list(make_reader(stream).iter_messages(topics=["/gripper/jaw"]))
    (found,) = messages
    assert (found[2].publish_time, found[2].log_time) == (5, 77)


def test_an_unwritable_folder_is_one_clear_error(tmp_path: Path) -> None:
    blocker = tmp_path / "file"
    blocker.write_text("")
    with pytest.raises(RecordWriteError, match="cannot create"):
        TrialRecorder(blocker / "take")
