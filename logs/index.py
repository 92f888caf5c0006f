"""The session's index: an SQLite table of takes, for lists and queries.

It is a cache of journal and records, never the truth: delete it and it is built again, row for
row the same. Any SQLite client may query it (`takes`, `scores`).
"""

from __future__ import annotations

import json
import sqlite3
from collections.abc import Iterator, Mapping
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from logs.errors import RecordReadError
from logs.session import SessionFolder
from logs.state import SessionState, TakeState, TrialState
from logs.trial_folder import PART_NAME, RECORD_NAME, folder_identity, take_folders

INDEX_NAME = "index.sqlite"
INDEX_VERSION = 1
_SCHEMA = """
CREATE TABLE about (name TEXT PRIMARY KEY, value TEXT NOT NULL) STRICT;
CREATE TABLE takes (
    trial_id TEXT NOT NULL,
    take INTEGER NOT NULL,
    number INTEGER NOT NULL,
    folder TEXT NOT NULL,
    object_name TEXT NOT NULL,
    grasp_id TEXT NOT NULL,
    repeat INTEGER NOT NULL,
    stable_pose INTEGER,
    status TEXT NOT NULL,
    counts INTEGER NOT NULL,
    outcome TEXT,
    reason TEXT,
    rotated INTEGER,
    operator TEXT,
    sensor TEXT,
    record TEXT NOT NULL,
    exit_status TEXT,
    problem TEXT,
    started_ns INTEGER,
    stopped_ns INTEGER,
    record_size INTEGER,
    record_mtime_ns INTEGER,
    PRIMARY KEY (trial_id, take)
) STRICT;
CREATE TABLE scores (
    trial_id TEXT NOT NULL,
    take INTEGER NOT NULL,
    model TEXT NOT NULL,
    version TEXT NOT NULL,
    value REAL NOT NULL,
    PRIMARY KEY (trial_id, take, model)
) STRICT;
"""
_OF_RECORD = (
    "record",
    "exit_status",
    "problem",
    "sensor",
    "started_ns",
    "stopped_ns",
    "record_size",
    "record_mtime_ns",
)


@dataclass(frozen=True, slots=True)
class IndexRow:
    """One take, as a list shows it.

    Args:
        folder: of the take, relative to the session.
        status: running, executed, redone, voided, interrupted or unknown (no journal entry).
        counts: this take is the trial's valid one.
        outcome: the label that counts; None while there is none.
        record: complete, unfinished, damaged or missing.
        scores: newest value of each model.
    """

    trial_id: str
    take: int
    number: int
    folder: str
    object_name: str
    grasp_id: str
    status: str
    counts: bool
    outcome: str | None
    reason: str | None
    sensor: str | None
    record: str
    problem: str | None
    scores: Mapping[str, float]


def list_takes(path: Path) -> list[IndexRow]:
    """All takes of a session in the order of trials; brings the index up to date first.

    Raises:
        NotASessionError: if the folder is no session.
        JournalDamagedError: if the journal needs `reach recover`.
    """
    folder = SessionFolder.open(path)
    with closing(_current(folder)) as database:
        return list(_rows(database))


def rebuild_index(folder: SessionFolder) -> None:
    """Build the index from nothing but journal and records."""
    with closing(_open(folder)) as database:
        _fill(database, folder, {})


def _current(folder: SessionFolder) -> sqlite3.Connection:
    """The index, updated where journal or records changed."""
    database = _open(folder)
    try:
        if _about(database) != _fingerprint(folder):
            _fill(database, folder, _known_records(database))
    except BaseException:
        database.close()
        raise
    return database


def _open(folder: SessionFolder) -> sqlite3.Connection:
    """Open the index file; one that is damaged or of another version begins anew."""
    path = folder.path / INDEX_NAME
    database = sqlite3.connect(path)
    try:
        version = database.execute("PRAGMA user_version").fetchone()[0]
        if version == INDEX_VERSION:
            database.execute("SELECT count(*) FROM takes").fetchone()
            return database
    except sqlite3.DatabaseError:
        pass
    database.close()
    for leftover in (path, *folder.path.glob(f"{INDEX_NAME}-*")):
        leftover.unlink(missing_ok=True)
    database = sqlite3.connect(path)
    database.execute("PRAGMA journal_mode = WAL")
    database.executescript(f"{_SCHEMA} PRAGMA user_version = {INDEX_VERSION};")
    return database


def _fingerprint(folder: SessionFolder) -> dict[str, str]:
    """What the index depends on, cheaply: the journal, and each record's size and time."""
    journal = folder.journal_path.stat()
    records = [
        (path.name, *_stat(path / RECORD_NAME), *_stat(path / PART_NAME))
        for path in take_folders(folder.path)
    ]
    return {
        "session_id": folder.descriptor.session_id,
        "journal": json.dumps([journal.st_size, journal.st_mtime_ns]),
        "records": json.dumps(records),
    }


def _stat(path: Path) -> tuple[int, int]:
    try:
        found = path.stat()
    except FileNotFoundError:
        return (-1, -1)
    return (found.st_size, found.st_mtime_ns)


def _about(database: sqlite3.Connection) -> dict[str, str]:
    return dict(database.execute("SELECT name, value FROM about"))


def _known_records(database: sqlite3.Connection) -> dict[tuple[str, int, int], dict[str, Any]]:
    """What unchanged records said, by folder, size and time."""
    columns = ", ".join(("folder", *_OF_RECORD))
    known = {}
    for row in database.execute(f"SELECT {columns} FROM takes WHERE record = 'complete'"):
        facts = dict(zip(_OF_RECORD, row[1:], strict=True))
        known[(row[0], facts["record_size"], facts["record_mtime_ns"])] = facts
    return known


def _fill(
    database: sqlite3.Connection,
    folder: SessionFolder,
    known: Mapping[tuple[str, int, int], dict[str, Any]],
) -> None:
    about = _fingerprint(folder)
    state = folder.read_state()
    takes = [_take_row(folder, state, path, known) for path in take_folders(folder.path)]
    with database:
        for table in ("takes", "scores", "about"):
            database.execute(f"DELETE FROM {table}")
        database.executemany("INSERT INTO about VALUES (?, ?)", sorted(about.items()))
        for row in takes:
            names = ", ".join(row)
            marks = ", ".join(f":{name}" for name in row)
            database.execute(f"INSERT INTO takes ({names}) VALUES ({marks})", row)
        database.executemany("INSERT INTO scores VALUES (?, ?, ?, ?, ?)", _score_rows(state))


def _take_row(
    folder: SessionFolder,
    state: SessionState,
    path: Path,
    known: Mapping[tuple[str, int, int], dict[str, Any]],
) -> dict[str, Any]:
    number, trial_id, take_number = folder_identity(path) or (0, path.name, 1)
    trial = state.trials.get(trial_id)
    take = _take(trial, take_number)
    relative = str(path.relative_to(folder.path))
    facts = known.get((relative, *_stat(path / RECORD_NAME))) or _record_facts(path)
    return {
        "trial_id": trial_id,
        "take": take_number,
        "number": number,
        "folder": relative,
        **_planned(trial),
        **_decided(trial, take),
        **facts,
    }


def _take(trial: TrialState | None, number: int) -> TakeState | None:
    return trial.takes[number - 1] if trial and number <= len(trial.takes) else None


def _planned(trial: TrialState | None) -> dict[str, Any]:
    planned = trial.planned if trial else None
    return {
        "object_name": planned.object_name if planned else "",
        "grasp_id": planned.grasp_id if planned else "",
        "repeat": planned.repeat if planned else 0,
        "stable_pose": planned.stable_pose if planned else None,
    }


def _decided(trial: TrialState | None, take: TakeState | None) -> dict[str, Any]:
    label = take.label if take else None
    return {
        "status": take.status if take else "unknown",
        "counts": int(trial is not None and take is not None and trial.valid_take is take),
        "outcome": label.outcome.value if label else None,
        "reason": label.reason.value if label and label.reason else None,
        "rotated": int(label.rotated) if label else None,
        "operator": label.operator if label else None,
    }


def _record_facts(path: Path) -> dict[str, Any]:
    """What the take's record says, or why it says nothing."""
    from logs.record_brief import read_brief

    file = path / RECORD_NAME
    facts: dict[str, Any] = dict.fromkeys(_OF_RECORD)
    if not file.exists():
        return facts | {"record": "unfinished" if (path / PART_NAME).exists() else "missing"}
    size, mtime_ns = _stat(file)
    facts |= {"record_size": size, "record_mtime_ns": mtime_ns}
    try:
        brief = read_brief(file)
    except RecordReadError as error:
        problem = str(error).replace(str(file), RECORD_NAME)
        return facts | {"record": "damaged", "problem": problem}
    return facts | {
        "record": "damaged" if brief.damage else "complete",
        "problem": brief.damage,
        "exit_status": brief.stop.exit_status.value if brief.stop else None,
        "sensor": brief.execution.sensor_verdict if brief.execution else None,
        "started_ns": brief.descriptor.time_ns,
        "stopped_ns": brief.stop.time_ns if brief.stop else None,
    }


def _score_rows(state: SessionState) -> Iterator[tuple[str, int, str, str, float]]:
    for trial in state.order:
        for take in trial.takes:
            for model, score in sorted(take.scores.items()):
                yield trial.trial_id, take.take, model, score.version, score.value


def _rows(database: sqlite3.Connection) -> Iterator[IndexRow]:
    scores: dict[tuple[str, int], dict[str, float]] = {}
    for trial_id, take, model, value in database.execute(
        "SELECT trial_id, take, model, value FROM scores ORDER BY trial_id, take, model"
    ):
        scores.setdefault((trial_id, take), {})[model] = value
    columns = (
        "trial_id, take, number, folder, object_name, grasp_id, status, counts, outcome, reason,"
        " sensor, record, problem"
    )
    database.row_factory = sqlite3.Row
    for row in database.execute(f"SELECT {columns} FROM takes ORDER BY number, trial_id, take"):
        found = {**row, "counts": bool(row["counts"])}
        yield IndexRow(**found, scores=scores.get((row["trial_id"], row["take"]), {}))
