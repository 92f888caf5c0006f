"""New scores for recorded sessions: journal first, then the annotation files."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from collection.scoring.annotator import mirror_score, scored_event
from collection.scoring.predictions import score_take
from collection.session.setup import stated_pose_error
from logs.journal.state import SessionState
from logs.session.folder import SessionFolder
from logs.session.mirror import AnnotationMirror

if TYPE_CHECKING:
    from logs.journal.state import TakeState


def rescore(
    session: Path, models: Sequence[str], progress: Callable[[int, int], None] | None = None
) -> int:
    """Score every executed take of a session with models, as new events.

    An earlier score stays in the journal; the newest of a model counts.

    Args:
        session: its folder; nothing else may be writing to it.
        models: names of the models.
        progress: told how many takes are scored, and of how many.

    Returns:
        How many takes were scored.

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
        for number, (trial_id, take) in enumerate(takes):
            if progress is not None:
                progress(number, len(takes))
            assert take.record is not None
            for prediction in score_take((session / take.record).parent, models, pose_error):
                entry = journal.append(scored_event(trial_id, take.take, prediction))
                mirror_score(mirror, entry, prediction)
        return len(takes)
    finally:
        journal.close()


def _executed_takes(state: SessionState) -> list[tuple[str, TakeState]]:
    found = [(trial.trial_id, trial.valid_take) for trial in state.order]
    return [(trial_id, take) for trial_id, take in found if take is not None and take.record]
