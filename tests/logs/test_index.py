"""The index is a cache: deleted, it is rebuilt row for row the same."""

import os
import random
import shutil
import sqlite3
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import closing
from pathlib import Path

import pytest

from logs.errors import JournalDamagedError, NotASessionError
from logs.journal import events as ev
from logs.session.folder import SessionFolder
from logs.session.index import list_takes, rebuild_index
from logs.session.index_table import INDEX_NAME
from logs.trial_folder import (
    PART_NAME,
    RECORD_NAME,
    folder_identity,
    take_folder,
    take_folders,
)


@pytest.fixture
def session(sessions, tmp_path: Path) -> SessionFolder:
    return sessions.build_session(tmp_path / "s", 3, samples=3)


def dump(session: SessionFolder) -> list[str]:
    with closing(sqlite3.connect(session.path / INDEX_NAME)) as database:
        return list(database.iterdump())


def test_rows_say_what_journal_and_records_say(session: SessionFolder) -> None:
    rows = list_takes(session.path)
    assert [row.number for row in rows] == [1, 2, 3]
    assert [row.outcome for row in rows] == ["success", "success", "failure"]
    assert rows[2].reason == "slipped_on_lift"
    assert all(row.counts and row.record == "complete" and row.sensor == "held" for row in rows)
    assert rows[0].scores == {"point": 0.3, "reach": 0.37}
    assert (session.path / rows[0].folder / RECORD_NAME).exists()


def test_deleted_it_is_rebuilt_identical(session: SessionFolder) -> None:
    list_takes(session.path)
    before = dump(session)
    assert len(before) > 12
    for path in session.path.glob(f"{INDEX_NAME}*"):
        path.unlink()
    list_takes(session.path)
    assert dump(session) == before
    rebuild_index(session)
    assert dump(session) == before


def test_updates_equal_a_rebuild(sessions, tmp_path: Path) -> None:
    folder = sessions.make_session(tmp_path / "s", 4)
    seen = []
    for numbers in (range(1, 3), range(3, 5)):
        with folder.open_journal(clock=sessions.Clock()) as journal:
            sessions.run_trials(folder, journal, numbers, samples=2)
        seen.append(len(list_takes(folder.path)))
    with folder.open_journal(clock=sessions.Clock()) as journal:
        first = folder.descriptor.trials[0].trial_id
        journal.append(
            ev.Relabelled(
                trial_id=first,
                take=1,
                outcome=ev.Outcome.FAILURE,
                reason=ev.FailureReason.MISSED,
                **sessions.SIM,
            )
        )
    assert seen == [2, 4]
    assert list_takes(folder.path)[0].outcome == "failure"
    updated = dump(folder)
    rebuild_index(folder)
    assert dump(folder) == updated


def random_events(randomly: random.Random, trials: Sequence[str]) -> list[ev.AnyEvent]:
    """A few events in any order: what a session, a console, a scorer and recovery may write."""
    about = {"trial_id": randomly.choice(trials), "take": randomly.choice((1, 1, 2))}
    trial = {"trial_id": about["trial_id"]}
    by = {"operator": "sim", "source": ev.Source.OPERATOR_SIM}
    sensor = ev.SensorVerdict(lifted=True)
    success, missed = ev.Outcome.SUCCESS, ev.FailureReason.MISSED
    tricky = '","trial_id":"00000000-0000-0000-0000-000000000000","x":"'
    choices: list[list[ev.AnyEvent]] = [
        [ev.TrialStarted(**about)],
        [ev.TrialStarted(**about), ev.Executed(**about, record="r", sensor=sensor)],
        [ev.PhaseEntered(**about, phase=ev.Phase.EXECUTE, info={"trial_id": "another"})],
        [ev.Labelled(**about, outcome=success, note=tricky, **by)],
        [ev.Relabelled(**about, outcome=ev.Outcome.FAILURE, reason=missed, **by)],
        [ev.Redone(**about, cause=ev.RedoCause.PLACEMENT, **by)],
        [ev.Voided(**about, reason="a fault")],
        [ev.Skipped(**trial, **by)],
        [ev.Undone(**trial, undoes=randomly.randrange(1, 60), **by)],
        [ev.NeedsLabel(**trial, why="lost")],
        [ev.Scored(**about, model="reach", version="2", value=randomly.random())],
        [ev.Noted(text=tricky, **by), ev.Noted(**trial, text="odd", **by)],
        [ev.SessionOpened(segment=0, fingerprints={}, **by)],
        [ev.SessionClosed(status="ended")],
    ]
    return randomly.choice(choices)


def change_a_folder(randomly: random.Random, session: SessionFolder) -> None:
    """A take's folder appears, vanishes, or its record is touched."""
    folders = take_folders(session.path)
    chosen = randomly.choice(folders)
    number, trial_id, take = folder_identity(chosen) or (0, "", 0)
    match randomly.randrange(3):
        case 0:
            take_folder(session.path, number, trial_id, take + 1).mkdir(exist_ok=True)
        case 1 if len(folders) > 2:
            shutil.rmtree(chosen)
        case _ if (chosen / RECORD_NAME).exists():
            os.utime(chosen / RECORD_NAME, ns=(0, randomly.randrange(10**18)))


@pytest.mark.parametrize("seed", range(6))
def test_any_change_updates_to_what_a_rebuild_gives(session: SessionFolder, seed: int) -> None:
    randomly = random.Random(seed)
    trials = [trial.trial_id for trial in session.descriptor.trials]
    for _ in range(25):
        with session.open_journal() as journal:
            for event in random_events(randomly, trials):
                journal.append(event)
        if randomly.random() < 0.3:
            change_a_folder(randomly, session)
        listed = list_takes(session.path)
        updated = dump(session)
        rebuild_index(session)
        assert dump(session) == updated
        assert list_takes(session.path) == listed


def test_a_change_is_told_from_the_journal_s_tail(session: SessionFolder, monkeypatch) -> None:
    list_takes(session.path)
    trial_id = session.descriptor.trials[1].trial_id
    with session.open_journal() as journal:
        journal.append(ev.Scored(trial_id=trial_id, take=1, model="new", version="1", value=0.25))
    with monkeypatch.context() as patched:
        patched.setattr("logs.session.index.read_journal", None)  # reading it all would fail
        assert list_takes(session.path)[1].scores["new"] == 0.25
    assert list_takes(session.path)[0].scores == {"point": 0.3, "reach": 0.37}


@pytest.mark.parametrize("place", [0.1, 0.5, 0.999])
def test_damage_in_the_part_already_seen_is_noticed(session: SessionFolder, place: float) -> None:
    list_takes(session.path)
    content = bytearray(session.journal_path.read_bytes())
    content[int(place * len(content))] ^= 1
    session.journal_path.write_bytes(content)
    with pytest.raises(JournalDamagedError):
        list_takes(session.path)


def test_a_copied_folder_is_a_row_of_its_own(session: SessionFolder) -> None:
    first = take_folders(session.path)[0]
    shutil.copytree(first, first.with_name(first.name.replace("0001_", "0009_")))
    assert [row.number for row in list_takes(session.path)] == [1, 2, 3, 9]


@pytest.mark.parametrize("content", [b"", b"not a database", b"SQLite format 3\0" + bytes(200)])
def test_a_damaged_index_is_rebuilt(session: SessionFolder, content: bytes) -> None:
    expected = list_takes(session.path)
    for path in session.path.glob(f"{INDEX_NAME}*"):
        path.unlink()
    (session.path / INDEX_NAME).write_bytes(content)
    assert list_takes(session.path) == expected


def test_lists_asked_for_at_once_are_the_same_list(session: SessionFolder) -> None:
    expected = list_takes(session.path)
    for _ in range(5):
        for path in session.path.glob(f"{INDEX_NAME}*"):
            path.unlink()
        with ThreadPoolExecutor(8) as pool:
            for listed in pool.map(list_takes, [session.path] * 16):
                assert listed == expected


def test_a_folder_that_takes_no_index_is_listed_all_the_same(session: SessionFolder) -> None:
    expected = list_takes(session.path)
    for path in session.path.glob(f"{INDEX_NAME}*"):
        path.unlink()
    (session.path / INDEX_NAME).mkdir()  # like a folder that may only be read, also for root
    assert list_takes(session.path) == expected
    assert list((session.path / INDEX_NAME).iterdir()) == []


def test_missing_damaged_and_unfinished_records_are_rows_too(session: SessionFolder) -> None:
    folders = [session.path / row.folder for row in list_takes(session.path)]
    (folders[0] / RECORD_NAME).unlink()
    data = (folders[1] / RECORD_NAME).read_bytes()
    (folders[1] / RECORD_NAME).write_bytes(data[: len(data) // 2])
    (folders[2] / RECORD_NAME).rename(folders[2] / PART_NAME)
    rows = list_takes(session.path)
    assert [row.record for row in rows] == ["missing", "damaged", "unfinished"]
    assert rows[1].problem is not None and "ends early" in rows[1].problem
    updated = dump(session)
    rebuild_index(session)
    assert dump(session) == updated


def test_a_folder_that_is_not_in_the_plan_is_listed_as_unknown(session: SessionFolder) -> None:
    take_folder(session.path, 99, "stranger").mkdir()
    assert [row.status for row in list_takes(session.path)] == ["executed"] * 3 + ["unknown"]


def test_no_session(tmp_path: Path) -> None:
    with pytest.raises(NotASessionError):
        list_takes(tmp_path)
