"""The session's index: an SQLite table of takes, for lists and queries.

It is a cache of journal and records, never the truth: delete it and it is built again, row for
row the same. Any SQLite client may query it (`takes`, `scores`). When journal or records change,
only the trials they tell of are looked at again.
"""

from __future__ import annotations

import sqlite3
from collections.abc import Collection, Iterator, Mapping, Sequence
from contextlib import closing
from dataclasses import astuple
from pathlib import Path
from typing import Any

from logs.errors import RecordReadError
from logs.journal.file import read_journal
from logs.journal.state import SessionState, TakeState, TrialState
from logs.session import index_table as table
from logs.session.folder import SessionFolder
from logs.session.index_journal import (
    JournalMark,
    complete_lines,
    entries_about,
    mark_end,
    news_since,
)
from logs.session.index_table import IndexRow
from logs.trial_folder import PART_NAME, RECORD_NAME, TRIALS, folder_identity, take_folders

Known = Mapping[tuple[str, int, int], dict[str, Any]]


def list_takes(path: Path) -> list[IndexRow]:
    """All takes of a session in the order of trials; brings the index up to date first.

    A session that may only be read is listed from journal and records alone.

    Raises:
        NotASessionError: if the folder is no session.
        JournalDamagedError: if the journal needs `reach recover`.
    """
    folder = SessionFolder.open(path)
    with table.alone(folder.path):
        try:
            with closing(table.open_index(folder.path)) as database:
                return _listed(database, folder)
        except (sqlite3.OperationalError, OSError):
            pass  # a folder that may only be read, a full disk: the index is only a cache
    with closing(table.passing_index()) as database:
        return _listed(database, folder)


def rebuild_index(folder: SessionFolder) -> None:
    """Build the index from nothing but journal and records."""
    with table.alone(folder.path), closing(table.open_index(folder.path)) as database:
        _fill(database, folder, _sources(folder), known={})


def _listed(database: sqlite3.Connection, folder: SessionFolder) -> list[IndexRow]:
    about = table.read_about(database)
    sources = _sources(folder)
    if any(about.get(name) != value for name, value in sources.items()):
        _update(database, folder, about, sources)
    return list(table.read_rows(database))


def _sources(folder: SessionFolder) -> dict[str, Any]:
    """What the index depends on, cheaply: the journal's and each record's size and time."""
    return {
        "session_id": folder.descriptor.session_id,
        "journal": _stat(folder.journal_path),
        "records": {
            path.name: [*_stat(path / RECORD_NAME), *_stat(path / PART_NAME)]
            for path in take_folders(folder.path)
        },
    }


def _stat(path: Path) -> list[int]:
    try:
        found = path.stat()
    except FileNotFoundError:
        return [-1, -1]
    return [found.st_size, found.st_mtime_ns]


def _update(
    database: sqlite3.Connection,
    folder: SessionFolder,
    about: Mapping[str, Any],
    sources: Mapping[str, Any],
) -> None:
    """Bring the rows up to date, looking only at what changed if that can be told."""
    known = table.known_records(database)
    content = complete_lines(folder.journal_path)
    mark = JournalMark(*about["mark"]) if "mark" in about else None
    news = news_since(content, mark) if mark else None
    if news is None or about["session_id"] != sources["session_id"]:
        _fill(database, folder, sources, known)
        return
    told, mark = news
    trials = told.trials | _changed(about["records"], sources["records"])
    if told.of_session:  # opening or closing a session ends what was under way
        trials |= table.running_trials(database)
    planned = [trial for trial in folder.descriptor.trials if trial.trial_id in trials]
    entries = entries_about(content, trials) if planned else ()
    state = SessionState.fold(planned, entries)
    _store(database, folder, state, known, {**sources, "mark": astuple(mark)}, trials)


def _fill(
    database: sqlite3.Connection, folder: SessionFolder, sources: Mapping[str, Any], known: Known
) -> None:
    """Write all rows."""
    content = complete_lines(folder.journal_path)
    entries = read_journal(folder.journal_path)
    mark = mark_end(content)
    state = SessionState.fold(folder.descriptor.trials, entries)
    _store(database, folder, state, known, {**sources, "mark": astuple(mark)}, None)


def _changed(before: Mapping[str, Any], now: Mapping[str, Any]) -> set[str]:
    """Trials whose folders or records changed."""
    names = {name for name in before.keys() | now.keys() if before.get(name) != now.get(name)}
    return {_identity(Path(name))[1] for name in names}


def _store(
    database: sqlite3.Connection,
    folder: SessionFolder,
    state: SessionState,
    known: Known,
    about: Mapping[str, Any],
    trials: Collection[str] | None,
) -> None:
    """Write the rows of some trials, or of all (None), in one transaction."""
    paths = [folder.path / TRIALS / name for name in about["records"]]
    wanted = [path for path in paths if trials is None or _identity(path)[1] in trials]
    takes = [_take_row(folder, state, path, known) for path in wanted]
    with database:
        table.forget(database, trials)
        table.insert(database, takes, _score_rows(state.order))
        table.write_about(database, about)


def _identity(path: Path) -> tuple[int, str, int]:
    return folder_identity(path) or (0, path.name, 1)


def _take_row(
    folder: SessionFolder, state: SessionState, path: Path, known: Known
) -> dict[str, Any]:
    number, trial_id, take_number = _identity(path)
    trial = state.trials.get(trial_id)
    take = trial.takes[take_number - 1] if trial and take_number <= len(trial.takes) else None
    relative = str(path.relative_to(folder.path))
    size, mtime_ns = _stat(path / RECORD_NAME)
    facts = known.get((relative, size, mtime_ns)) or _record_facts(path)
    return {
        "folder": relative,
        "trial_id": trial_id,
        "take": take_number,
        "number": number,
        **_planned(trial),
        **_decided(trial, take),
        **facts,
    }


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
    from logs.record.outline import read_outline

    file = path / RECORD_NAME
    facts: dict[str, Any] = dict.fromkeys(table.OF_RECORD)
    if not file.exists():
        return facts | {"record": "unfinished" if (path / PART_NAME).exists() else "missing"}
    size, mtime_ns = _stat(file)
    facts |= {"record_size": size, "record_mtime_ns": mtime_ns}
    try:
        record = read_outline(file)
    except RecordReadError as error:
        problem = str(error).replace(str(file), RECORD_NAME)
        return facts | {"record": "damaged", "problem": problem}
    return facts | {
        "record": "damaged" if record.damage else "complete",
        "problem": record.damage,
        "exit_status": record.stop.exit_status.value if record.stop else None,
        "sensor": record.execution.sensor_verdict if record.execution else None,
        "started_ns": record.descriptor.time_ns,
        "stopped_ns": record.stop.time_ns if record.stop else None,
    }


def _score_rows(trials: Sequence[TrialState]) -> Iterator[tuple[str, int, str, str, float]]:
    for trial in trials:
        for take in trial.takes:
            for model, score in sorted(take.scores.items()):
                yield trial.trial_id, take.take, model, score.version, score.value
