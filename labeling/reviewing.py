"""A recorded session, opened for labeling again."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from labeling.control.commands import Actor
from labeling.control.controller import SessionController
from labeling.display.console import Console
from logs.errors import LogError
from logs.journal.state import SessionState, TrialState
from logs.session.folder import SessionFolder
from logs.session.mirror import AnnotationMirror
from logs.session.mirrored_journal import MirroredJournal


@contextmanager
def review_console(
    folder: SessionFolder, actor: Actor, *, second: bool = False
) -> Iterator[Console]:
    """Open a session as its one writer, for labels only.

    Args:
        folder: the session; nothing else may be writing to it.
        actor: who labels.
        second: label blindly as a second operator, for agreement.

    Raises:
        SessionLockedError: if the session is under way.
    """
    journal = folder.open_journal()
    state = SessionState.fold(folder.descriptor.trials, journal.entries)
    state.stand_down()
    sink = MirroredJournal(journal, AnnotationMirror(folder, journal.entries))
    controller = SessionController(sink, state)
    try:
        yield Console(
            controller,
            actor,
            title=folder.path.name,
            mode="review",
            recordings=lambda trial: blind_recording(folder, trial),
            root=folder.path,
            simulated=folder.descriptor.simulated,
            second=second,
            sitting_since=state.seq,
            hold_without_console=False,
        )
    finally:
        controller.close(None)


def blind_recording(folder: SessionFolder, trial: TrialState) -> Path | None:
    """The view of a trial without label, contacts or scores; None if it cannot be drawn."""
    from logs.view.trial import fresh_view

    take = trial.valid_take
    if take is None:
        return None
    try:
        return fresh_view(folder.trial_folder(trial.trial_id, take.take), blind=True)
    except (LogError, OSError):
        return None
