"""New scores for recorded sessions: journal first, then the annotation files."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from collection.scoring.annotator import mirror_score, scored_event
from collection.scoring.predictions import score_take
from collection.session.setup import stated_pose_error
from logs.errors import RecordError
from logs.journal.state import SessionState
from logs.session.folder import SessionFolder
from logs.session.mirror import AnnotationMirror

if TYPE_CHECKING:
    from logs.journal.state import TakeState


class Rescored(NamedTuple):
    """How many takes were scored, and what was wrong with the records of the others."""

    scored: int
    unreadable: tuple[str, ...]


def rescore(
    session: Path, models: Sequence[str], progress: Callable[[int, int], None] | None = None
) -> Rescored:
    """Score every executed take of a session with models, as new events.

    An earlier score stays in the journal; the newest of a model counts.

    Args:
        session: its folder; nothing else may be writing to it.
        models: names of the models.
        progress: told how many takes are scored, and of how many.

    Returns:
        How many takes were scored, and why others were not: their records cannot be read.

    Raises:
        NotASessionError: no session there.
        SessionLockedError: the session is under way.
        UnknownNameError: no model has this name.
    """
    folder = SessionFolder.open(session)
    pose_error = stated_pose_error(folder)
    journal = folder.open_journal()
    try:
        state = SessionState.fold(folder.descriptor.trials, journal.entries)
        mirror = AnnotationMirror(folder, journal.entries)
        takes = _executed_takes(state)
        unreadable: list[str] = []
        for number, (trial_id, take) in enumerate(takes):
            if progress is not None:
                progress(number, len(takes))
            assert take.record is not None
            try:
                predictions = score_take((session / take.record).parent, models, pose_error)
            except RecordError as error:
                unreadable.append(str(error))
                continue
            for prediction in predictions:
                entry = journal.append(scored_event(trial_id, take.take, prediction))
                mirror_score(mirror, entry, prediction)
        return Rescored(len(takes) - len(unreadable), tuple(unreadable))
    finally:
        journal.close()


def _executed_takes(state: SessionState) -> list[tuple[str, TakeState]]:
    found = [(trial.trial_id, trial.valid_take) for trial in state.order]
    return [(trial_id, take) for trial_id, take in found if take is not None and take.record]
