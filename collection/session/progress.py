"""What the terminal shows while a session runs: object, trial n of N, successes, time left."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import TracebackType
from typing import Self

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn

from labeling.control.controller import SessionController
from logs.journal.events import Outcome


class SessionProgress:
    """A live line on a terminal, a line a trial elsewhere; a context manager.

    Args:
        controller: whose session is shown.
        console: where to.
    """

    def __init__(self, controller: SessionController, console: Console) -> None:
        self._controller = controller
        self._console = console
        self._began = time.monotonic()
        self._done_before = 0
        self._shown = -1
        self._scoring: int | None = None
        self._diverted: Callable[[str], None] | None = None
        self._bar = Progress(
            TextColumn("{task.fields[doing]}"),
            BarColumn(bar_width=24),
            MofNCompleteColumn(),
            TextColumn("{task.fields[rate]} lifted, {task.fields[left]} left"),
            console=console,
            transient=True,
            disable=not console.is_terminal,
        )
        self._task = self._bar.add_task("", total=1, doing="starting", rate="-", left="?")

    def __enter__(self) -> Self:
        with self._controller.reading() as state:
            self._done_before = self._shown = state.counts().labelled
        self._bar.start()
        self._forget = self._controller.listen(self._look)
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self._forget()
        self._bar.stop()

    def say(self, message: str) -> None:
        """Print a line above the progress, or where the lines go now."""
        if self._diverted is not None:
            self._diverted(message)
        else:
            self._console.print(message, markup=False, highlight=False)

    @contextmanager
    def elsewhere(self, lines: Callable[[str], None]) -> Iterator[None]:
        """While something else owns the screen: no live line, and `lines` is told what is said."""
        self._bar.stop()
        self._diverted = lines
        try:
            yield
        finally:
            self._diverted = None
            self._bar.start()

    def scoring(self, waiting: int) -> None:
        """Tell how many takes still wait for their scores."""
        self._bar.update(self._task, doing=f"scoring: {waiting} left", left="-")
        quiet = self._console.is_terminal or waiting == self._scoring
        if waiting and not quiet and (self._scoring is None or waiting % 25 == 0):
            self.say(f"scoring: {waiting} left")
        self._scoring = waiting

    def _look(self) -> None:
        with self._controller.reading() as state:
            counts, trial = state.counts(), state.current_trial
            decided = state.last_decision()
        total = counts.planned - counts.skipped
        rate = f"{counts.successes} of {counts.labelled}"
        left = self._time_left(counts.labelled, total)
        name = trial.planned.object_name if trial else ""
        phase = trial.takes[-1].phase.value.lower().replace("_", " ") if trial else ""
        doing = f"{name}: {phase}" if name else "starting"
        self._bar.update(
            self._task, completed=counts.labelled, total=total, doing=doing, rate=rate, left=left
        )
        before, self._shown = self._shown, counts.labelled
        if counts.labelled <= before or self._console.is_terminal or decided is None:
            return
        labelled, entry = decided
        name = labelled.planned.object_name
        lifted = getattr(entry.event, "outcome", None) is Outcome.SUCCESS
        verdict = "lifted" if lifted else "not lifted"
        self.say(f"trial {counts.labelled} of {total}  {name}: {verdict}  ({rate}, {left} left)")

    def _time_left(self, done: int, total: int) -> str:
        fresh = done - self._done_before
        if fresh <= 0:
            return "?"
        seconds = (time.monotonic() - self._began) / fresh * (total - done)
        minutes, rest = divmod(round(seconds), 60)
        hours, minutes = divmod(minutes, 60)
        return f"{hours}:{minutes:02d}:{rest:02d}" if hours else f"{minutes}:{rest:02d}"
