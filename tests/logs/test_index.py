"""The index is a cache: deleted, it is rebuilt row for row the same."""

import sqlite3
from contextlib import closing
from pathlib import Path

import pytest

from logs import events as ev
from logs.errors import NotASessionError
from logs.index import INDEX_NAME, list_takes, rebuild_index
from logs.session import SessionFolder
from logs.trial_folder import PART_NAME, RECORD_NAME, take_folder


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


@pytest.mark.parametrize("content", [b"", b"not a database", b"SQLite format 3\0" + bytes(200)])
def test_a_damaged_index_is_rebuilt(session: SessionFolder, content: bytes) -> None:
    expected = list_takes(session.path)
    for path in session.path.glob(f"{INDEX_NAME}*"):
        path.unlink()
    (session.path / INDEX_NAME).write_bytes(content)
    assert list_takes(session.path) == expected


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
