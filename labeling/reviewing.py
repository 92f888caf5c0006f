"""A recorded session, opened for labeling again."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from labeling.commands import Actor
from labeling.console import Console
from labeling.controller import SessionController
from logs.errors import LogError
from logs.events import AnyEvent, Entry
from logs.journal import Journal
from logs.mirror import AnnotationMirror
from logs.session import SessionFolder
from logs.state import SessionState, TrialState


class MirroredJournal:
    """A journal whose labels also appear as annotation files beside the records.

    Args:
        journal: the truth.
        mirror: writes the files; what it cannot write now, recovery writes later.
    """

    def __init__(self, journal: Journal, mirror: AnnotationMirror) -> None:
        self._journal = journal
        self._mirror = mirror

    def append(self, event: AnyEvent) -> Entry:
        """Store an event, then mirror it."""
        entry = self._journal.append(event)
        with suppress(LogError):
            self._mirror.note(entry)
        return entry

    def close(self) -> None:
        """Take no more events."""
        self._journal.close()


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
            hold_without_console=False,
        )
    finally:
        controller.close(None)


def blind_recording(folder: SessionFolder, trial: TrialState) -> Path | None:
    """The view of a trial without label, contacts or scores; None if it cannot be drawn."""
    from logs.rerun_view import fresh_view

    take = trial.valid_take
    if take is None:
        return None
    try:
        return fresh_view(folder.trial_folder(trial.trial_id, take.take), blind=True)
    except (LogError, OSError):
        return None
