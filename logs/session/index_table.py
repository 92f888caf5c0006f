"""The index's SQLite file: its tables, and what is read from and written to them."""

from __future__ import annotations

import fcntl
import json
import os
import sqlite3
from collections.abc import Collection, Iterable, Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

INDEX_NAME = "index.sqlite"
INDEX_VERSION = 2
# Without row ids, rows lie in the order of their keys: an updated file equals a rebuilt one.
_SCHEMA = """
CREATE TABLE about (name TEXT PRIMARY KEY, value TEXT NOT NULL) STRICT, WITHOUT ROWID;
CREATE TABLE takes (
    folder TEXT PRIMARY KEY,
    trial_id TEXT NOT NULL,
    take INTEGER NOT NULL,
    number INTEGER NOT NULL,
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
    record_mtime_ns INTEGER
) STRICT, WITHOUT ROWID;
CREATE TABLE scores (
    trial_id TEXT NOT NULL,
    take INTEGER NOT NULL,
    model TEXT NOT NULL,
    version TEXT NOT NULL,
    value REAL NOT NULL,
    PRIMARY KEY (trial_id, take, model)
) STRICT, WITHOUT ROWID;
"""
OF_RECORD = (
    "record",
    "exit_status",
    "problem",
    "sensor",
    "started_ns",
    "stopped_ns",
    "record_size",
    "record_mtime_ns",
)
"""Columns that only the record's file determines."""


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


@contextmanager
def alone(session: Path) -> Iterator[None]:
    """Wait until no other process makes or updates the session's index, and keep them waiting.

    The folder itself is locked, which needs no right to write; where the file system knows no
    locks, nothing is waited for.
    """
    descriptor = os.open(session, os.O_RDONLY | os.O_DIRECTORY | os.O_CLOEXEC)
    try:
        with suppress(OSError):
            fcntl.flock(descriptor, fcntl.LOCK_EX)
        yield
    finally:
        os.close(descriptor)


def open_index(session: Path) -> sqlite3.Connection:
    """Open a session's index; one that is damaged or of another version begins anew.

    To be called [alone][logs.session.index_table.alone].

    Raises:
        sqlite3.OperationalError: the folder or its disk takes no index.
        OSError: likewise.
    """
    path = session / INDEX_NAME
    database = sqlite3.connect(path)
    try:
        version = database.execute("PRAGMA user_version").fetchone()[0]
        tables = {name for (name,) in database.execute("SELECT name FROM sqlite_master")}
        if version == INDEX_VERSION and tables >= {"about", "takes", "scores"}:
            database.execute("SELECT count(*) FROM takes").fetchone()
            return database
    except sqlite3.OperationalError:
        database.close()
        raise
    except sqlite3.DatabaseError:
        pass
    database.close()
    for leftover in (path, *session.glob(f"{INDEX_NAME}-*")):
        leftover.unlink(missing_ok=True)
    database = sqlite3.connect(path)
    database.execute("PRAGMA journal_mode = WAL")
    return _with_tables(database)


def passing_index() -> sqlite3.Connection:
    """An empty index in memory, for a folder that takes none."""
    return _with_tables(sqlite3.connect(":memory:"))


def _with_tables(database: sqlite3.Connection) -> sqlite3.Connection:
    database.executescript(f"{_SCHEMA} PRAGMA user_version = {INDEX_VERSION};")
    return database


def read_about(database: sqlite3.Connection) -> dict[str, Any]:
    """What the index was made from."""
    rows = database.execute("SELECT name, value FROM about")
    return {name: json.loads(value) for name, value in rows}


def write_about(database: sqlite3.Connection, about: Mapping[str, Any]) -> None:
    """Note what the index was made from."""
    rows = [(name, json.dumps(value)) for name, value in about.items()]
    database.execute("DELETE FROM about")
    database.executemany("INSERT INTO about VALUES (?, ?)", rows)


def known_records(database: sqlite3.Connection) -> dict[tuple[str, int, int], dict[str, Any]]:
    """What whole records said, by folder, size and time."""
    columns = ", ".join(("folder", *OF_RECORD))
    known = {}
    for row in database.execute(f"SELECT {columns} FROM takes WHERE record = 'complete'"):
        facts = dict(zip(OF_RECORD, row[1:], strict=True))
        known[(row[0], facts["record_size"], facts["record_mtime_ns"])] = facts
    return known


def running_trials(database: sqlite3.Connection) -> set[str]:
    """Trials with a take under way."""
    rows = database.execute("SELECT DISTINCT trial_id FROM takes WHERE status = 'running'")
    return {trial_id for (trial_id,) in rows}


def forget(database: sqlite3.Connection, trials: Collection[str] | None) -> None:
    """Delete the rows of some trials, or of all (None)."""
    for table in ("takes", "scores"):
        if trials is None:
            database.execute(f"DELETE FROM {table}")
        else:
            which = [(trial_id,) for trial_id in trials]
            database.executemany(f"DELETE FROM {table} WHERE trial_id = ?", which)


def insert(
    database: sqlite3.Connection, takes: Iterable[dict[str, Any]], scores: Iterable[tuple[Any, ...]]
) -> None:
    """Add rows."""
    for row in takes:
        marks = ", ".join(f":{name}" for name in row)
        database.execute(f"INSERT INTO takes ({', '.join(row)}) VALUES ({marks})", row)
    database.executemany("INSERT INTO scores VALUES (?, ?, ?, ?, ?)", scores)


def read_rows(database: sqlite3.Connection) -> Iterator[IndexRow]:
    """All takes in the order of trials."""
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
