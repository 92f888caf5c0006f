"""What a console server is given: one session, who operates it, and what may be shown."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Final, Literal

from labeling.control.commands import Actor, Answer, Command, CommandKind
from labeling.control.controller import SessionController
from labeling.control.judging import rejection
from labeling.display.pictures import PictureShelf
from logs.journal.state import TrialState

Recordings = Callable[[TrialState], Path | None]


SECOND_KINDS: Final = frozenset({CommandKind.SECOND_LABEL, CommandKind.UNDO_SECOND})
"""What a second operator does, and nobody else."""
REVIEW_KINDS: Final = frozenset({CommandKind.RELABEL, CommandKind.UNDO})
"""What a review does: nothing in it moves, and its session is over."""


def no_recording(trial: TrialState) -> Path | None:
    """There is no recording to look at."""
    return None


@dataclass(frozen=True, slots=True, eq=False)
class Console:
    """One session's console, independent of how it is drawn.

    Args:
        controller: the session's writer.
        actor: who operates; every command of this console is theirs.
        title: shown at the top.
        mode: `run` a session, or `review` recorded trials.
        pictures: what may be looked at.
        recordings: the blind recording (.rrd) of an executed trial, for the moment of labeling
            and for relabeling; may draw it first, takes as long as it takes.
        root: the session's folder; nothing outside it is served. None in practice.
        simulated: the station is simulated.
        practice: nothing is stored.
        second: a second operator labels blindly, for agreement (review only).
        sitting_since: undo takes back what was decided after this entry of the journal; a review
            leaves earlier sittings' verdicts alone unless one is taken back by name.
        hold_without_console: hold the session while nobody is connected.
    """

    controller: SessionController
    actor: Actor
    title: str
    mode: Literal["run", "review"] = "run"
    pictures: PictureShelf = field(default_factory=lambda: PictureShelf(None))
    recordings: Recordings = no_recording
    root: Path | None = None
    simulated: bool = False
    practice: bool = False
    second: bool = False
    sitting_since: int = 0
    hold_without_console: bool = True

    @property
    def kinds(self) -> frozenset[CommandKind]:
        """What may be asked for at this console."""
        if self.mode == "run":
            return frozenset(CommandKind) - SECOND_KINDS
        return (SECOND_KINDS if self.second else REVIEW_KINDS) | {CommandKind.NOTE}

    def submit(self, command: Command) -> Answer:
        """Act upon a command in the name of who operates this console; thread-safe."""
        if command.kind in self.kinds:
            return self.controller.submit(command, self.actor)
        with self.controller.reading() as state:
            return rejection(state, command, f"{command.kind.value} is not for this console")
