"""After a crash: everything that was flushed is saved, nothing is deleted, mismatches are told."""

import os
import shutil
from pathlib import Path

import pytest

from logs.errors import JournalDamagedError, SessionLockedError
from logs.journal import events as ev
from logs.journal.file import JOURNAL_NAME, read_journal
from logs.journal.repair import BAD_NAME
from logs.record.annotation_files import read_annotations
from logs.record.recorder import TrialRecorder
from logs.record.records import ExitStatus, Severity
from logs.record.salvage import TORN_NAME
from logs.record.trial_record import read_record
from logs.session.folder import SessionFolder
from logs.session.index import list_takes
from logs.session.recovery import RecoveryReport, recover_session
from logs.trial_folder import PART_NAME, RECORD_NAME, annotation_paths, take_folders


@pytest.fixture
def session(sessions, tmp_path: Path) -> SessionFolder:
    return sessions.build_session(tmp_path / "s", 3, samples=3)


def texts(report: RecoveryReport) -> str:
    return "\n".join(f"{f.severity} {f.place}: {f.text}" for f in report.findings)


def files(folder: Path) -> dict[str, bytes]:
    kept = {}
    for path in sorted(folder.rglob("*")):
        if path.is_file() and not path.name.startswith(("index.sqlite", "writer.lock")):
            kept[str(path.relative_to(folder))] = path.read_bytes()
    return kept


def test_a_healthy_session_is_left_alone(session: SessionFolder) -> None:
    before = files(session.path)
    report = recover_session(session.path)
    assert report.clean and report.takes == 3
    assert files(session.path) == before


def kill_trial_four(sessions, made, session: SessionFolder, *, stop: bool) -> Path:
    """The state that a kill leaves: within the motion, or just before the rename."""
    entry = session.descriptor.trials[3]
    with session.open_journal(clock=sessions.Clock()) as journal:
        journal.append(ev.TrialStarted(trial_id=entry.trial_id, take=1))
    folder = session.trial_folder(entry.trial_id)
    with TrialRecorder(folder) as recorder:
        if stop:
            made.record_trial(recorder, samples=5, number=4, trial_id=entry.trial_id)
            data = (folder / RECORD_NAME).read_bytes()[:-30]
        else:
            recorder.start(made.descriptor(made.cube(), 4, entry.trial_id))
            recorder.jaw(1, 0.02)
            recorder.phase("lift")
            recorder.flush()
            data = (folder / PART_NAME).read_bytes()
            recorder.stop(ExitStatus.SUCCESS)
    (folder / PART_NAME).write_bytes(data)
    (folder / RECORD_NAME).unlink()
    return folder


def test_a_trial_killed_within_its_motion_is_saved_and_taken_again(
    sessions, made, session: SessionFolder
) -> None:
    folder = kill_trial_four(sessions, made, session, stop=False)
    torn = (folder / PART_NAME).read_bytes()
    report = recover_session(session.path)
    assert "saved up to its last flush" in texts(report)
    assert (folder / TORN_NAME).read_bytes() == torn
    record = read_record(folder)
    assert record.damage is None and record.stop is not None
    assert record.stop.exit_status is ExitStatus.ABORT and "killed" in record.stop.reason
    trial = session.read_state().order[3]
    assert trial.valid_take is None and trial.status != "unlabelled"
    assert recover_session(session.path).clean


def test_a_trial_killed_after_its_stop_only_needs_a_label(
    sessions, made, session: SessionFolder
) -> None:
    folder = kill_trial_four(sessions, made, session, stop=True)
    report = recover_session(session.path)
    assert "saved whole" in texts(report) and "needs a label" in texts(report)
    record = read_record(folder)
    assert record.complete and len(record.jaw.widths) == 5
    trial = session.read_state().order[3]
    assert trial.status == "unlabelled"
    take = trial.valid_take
    assert take is not None and take.recovered and take.sensor is not None
    assert take.sensor.lifted is True and take.sensor.jaw_width == 0.0297
    assert take.record == f"trials/{folder.name}/{RECORD_NAME}"
    assert list_takes(session.path)[3].record == "complete"
    assert recover_session(session.path).clean


def test_a_record_killed_before_its_first_flush_is_kept_as_it_is(session: SessionFolder) -> None:
    entry = session.descriptor.trials[3]
    folder = session.trial_folder(entry.trial_id)
    folder.mkdir()
    (folder / PART_NAME).write_bytes(b"\x89MCAP0\r\n")
    report = recover_session(session.path)
    assert "without a readable beginning" in texts(report)
    assert (folder / TORN_NAME).read_bytes() == b"\x89MCAP0\r\n"
    assert not (folder / RECORD_NAME).exists()


@pytest.mark.parametrize("moment", ["copying", "renamed"])
def test_a_rescue_that_was_killed_is_done_again(
    sessions, made, session: SessionFolder, moment: str, monkeypatch
) -> None:
    folder = kill_trial_four(sessions, made, session, stop=True)
    original = (folder / PART_NAME).read_bytes()

    class Killed(BaseException):
        pass

    def die(*_: object, **__: object) -> None:
        raise Killed

    with monkeypatch.context() as patched:
        if moment == "copying":
            patched.setattr("logs.record.mcap_file.DurableMcap.finish", die)
        else:
            real = os.rename

            def rename(source: Path, target: Path) -> None:
                if Path(target).name == RECORD_NAME:
                    raise Killed
                real(source, target)

            patched.setattr("logs.record.salvage.os.rename", rename)
        with pytest.raises(Killed):
            recover_session(session.path)
    assert not (folder / RECORD_NAME).exists()
    recover_session(session.path)
    assert read_record(folder).complete
    assert (folder / TORN_NAME).read_bytes() == original
    assert sorted(p.name for p in folder.iterdir()) == [RECORD_NAME, TORN_NAME]


def test_missing_annotations_are_written_again(session: SessionFolder) -> None:
    folder = take_folders(session.path)[0]
    before = read_annotations(folder)
    for path in annotation_paths(folder):
        path.unlink()
    report = recover_session(session.path)
    assert texts(report).count("written again") == 3
    after = read_annotations(folder)
    assert after.label == before.label
    assert {m: s.value for m, s in after.newest_scores.items()} == {"point": 0.3, "reach": 0.37}
    assert recover_session(session.path).clean


def test_a_damaged_annotation_is_replaced_and_kept(session: SessionFolder) -> None:
    folder = take_folders(session.path)[0]
    first = annotation_paths(folder)[0]
    damaged = first.read_bytes()[:700]
    first.write_bytes(damaged)
    report = recover_session(session.path)
    assert "damaged annotation" in texts(report) and "written again" in texts(report)
    assert read_annotations(folder).label is not None
    assert first.read_bytes() == damaged


def test_a_missing_record_is_an_error_and_its_label_stays(session: SessionFolder) -> None:
    shutil.rmtree(take_folders(session.path)[1])
    report = recover_session(session.path)
    (finding,) = report.findings
    assert finding.severity is Severity.ERROR and "it is missing" in finding.text
    assert session.read_state().order[1].status == "labelled"


def test_a_damaged_record_is_told_and_not_touched(session: SessionFolder) -> None:
    path = take_folders(session.path)[1] / RECORD_NAME
    data = bytearray(path.read_bytes())
    data[len(data) // 2] ^= 1
    path.write_bytes(data)
    report = recover_session(session.path)
    assert "ERROR" in texts(report).upper() and "the record is damaged" in texts(report)
    assert path.read_bytes() == data


def test_a_foreign_folder_and_a_swapped_record_are_told(session: SessionFolder) -> None:
    first, second, _ = take_folders(session.path)
    shutil.copy(first / RECORD_NAME, second / RECORD_NAME)
    (session.path / "trials" / "0077_stranger").mkdir()
    found = texts(recover_session(session.path))
    assert "the record is of trial" in found and "no trial of the plan" in found


def test_a_lost_label_is_asked_for_again(session: SessionFolder) -> None:
    """A bad line in the journal held a label: its copy is not trusted, a person is asked."""
    path = session.path / JOURNAL_NAME
    lines = path.read_bytes().split(b"\n")
    place = next(i for i, line in enumerate(lines) if b'"kind":"label"' in line)
    lines[place] = lines[place].replace(b'"success"', b'"failure"')
    path.write_bytes(b"\n".join(lines))
    with pytest.raises(JournalDamagedError):
        session.read_state()
    report = recover_session(session.path)
    assert "events lost" in texts(report) and "label again: 1" in texts(report)
    assert (session.path / BAD_NAME).read_bytes() == lines[place] + b"\n"
    kept = path.read_bytes().split(b"\n")
    assert kept[: len(lines) - 2] == lines[:place] + lines[place + 1 : -1]
    trial = session.read_state().order[0]
    assert trial.label is None and trial.status == "unlabelled" and trial.needs_label
    assert [t.status for t in session.read_state().order[1:3]] == ["labelled", "labelled"]
    assert read_annotations(take_folders(session.path)[0]).label is None
    assert recover_session(session.path).clean


@pytest.mark.parametrize("decision", ["undo", "redo", "relabel"])
@pytest.mark.parametrize("readable", [True, False])
def test_a_label_does_not_come_back_because_what_withdrew_it_is_lost(
    session: SessionFolder, decision: str, readable: bool
) -> None:
    trial = session.read_state().order[0]
    who = {"operator": "ann", "source": ev.Source.OPERATOR, "trial_id": trial.trial_id}
    event: ev.AnyEvent = {
        "undo": lambda: ev.Undone(undoes=trial.decisions[-1].seq, **who),
        "redo": lambda: ev.Redone(take=1, cause=ev.RedoCause.SEEING, **who),
        "relabel": lambda: ev.Relabelled(
            take=1, outcome=ev.Outcome.FAILURE, reason=ev.FailureReason.MISSED, **who
        ),
    }[decision]()
    with session.open_journal() as journal:
        journal.append(ev.PhaseEntered(trial_id=trial.trial_id, take=1, phase=ev.Phase.RESET))
        journal.append(event)
    path = session.path / JOURNAL_NAME
    lines = path.read_bytes().split(b"\n")
    lines[-2] = lines[-2].replace(b'"ann"', b'"bob"') if readable else b"garbage"
    path.write_bytes(b"\n".join(lines))
    recover_session(session.path)
    found = session.read_state().order[0]
    assert found.label is None and found.needs_label and found.status == "unlabelled"
    assert session.read_state().order[1].status == "labelled"
    assert recover_session(session.path).clean


def test_a_lost_score_puts_no_label_in_doubt(session: SessionFolder) -> None:
    path = session.path / JOURNAL_NAME
    lines = path.read_bytes().split(b"\n")
    place = next(i for i, line in enumerate(lines) if b'"kind":"score"' in line)
    lines[place] = lines[place].replace(b'"version":"1"', b'"version":"2"')
    path.write_bytes(b"\n".join(lines))
    assert not recover_session(session.path).clean
    assert [t.status for t in session.read_state().order[:3]] == ["labelled"] * 3


@pytest.mark.parametrize("bad", [0, 4, -2])
def test_any_bad_line_is_set_aside(session: SessionFolder, bad: int) -> None:
    path = session.path / JOURNAL_NAME
    lines = path.read_bytes().split(b"\n")
    count = len(read_journal(path))
    lines[bad] = b"garbage"
    path.write_bytes(b"\n".join(lines))
    assert not recover_session(session.path).clean
    kept = [e for e in read_journal(path) if not isinstance(e.event, ev.JournalRepaired)]
    assert len(kept) >= count - 1
    assert recover_session(session.path).clean


def test_an_unfinished_last_line_is_told(session: SessionFolder) -> None:
    path = session.path / JOURNAL_NAME
    with path.open("ab") as stream:
        stream.write(b'{"crc":"0000')
    report = recover_session(session.path)
    assert "never finished" in texts(report)
    assert (session.path / "events.torn").read_bytes() == b'{"crc":"0000\n'


def test_a_session_being_recorded_is_not_recovered(session: SessionFolder) -> None:
    with session.open_journal(), pytest.raises(SessionLockedError):
        recover_session(session.path)
