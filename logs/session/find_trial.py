"""Finding a trial by what a person types: its number, its id, or the id's beginning."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from logs.errors import UnknownTrialError
from logs.session.folder import SessionFolder
from logs.session.index import list_takes
from logs.session.index_table import IndexRow


def find_take(session: Path, wanted: str) -> Path:
    """Folder of the take of a trial that counts, or else of its newest one with a record.

    Args:
        session: the session's folder.
        wanted: number in the plan, trial id, or an id's unambiguous beginning.

    Raises:
        NotASessionError: if the folder is no session.
        UnknownTrialError: if no or more than one trial is meant, or it has no record yet.
    """
    folder = SessionFolder.open(session)
    trials = folder.descriptor.trials
    matches = [
        trial
        for trial in trials
        if wanted == str(trial.number) or (wanted and trial.trial_id.startswith(wanted))
    ]
    exact = [trial for trial in matches if wanted in (str(trial.number), trial.trial_id)]
    matches = exact or matches
    if len(matches) != 1:
        problem = "unknown trial" if not matches else "more than one trial matches"
        raise UnknownTrialError(f"{problem} {wanted!r}; valid: {_choices(folder)}")
    trial_id = matches[0].trial_id
    rows = [row for row in list_takes(session) if row.trial_id == trial_id]
    row = _best(rows)
    if row is None:
        raise UnknownTrialError(
            f"trial {matches[0].number} ({trial_id}) has no record yet; see `reach status {session}`"
        )
    return session / row.folder


def _best(rows: Sequence[IndexRow]) -> IndexRow | None:
    recorded = [row for row in rows if row.record != "missing"]
    counting = [row for row in recorded if row.counts]
    preferred = counting or recorded
    return preferred[-1] if preferred else None


def _choices(folder: SessionFolder) -> str:
    trials = folder.descriptor.trials
    if not trials:
        return "none"
    first, last = trials[0], trials[-1]
    return f"a number from {first.number} to {last.number}, or an id such as {first.trial_id}"
