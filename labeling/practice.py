"""Practice: all keys and answers of a session, and nothing is ever stored."""

from __future__ import annotations

import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Final

from labeling.control.commands import Actor
from labeling.control.controller import SessionController
from labeling.control.take import Take
from labeling.display.console import Console
from labeling.errors import SessionEndingError, TakeEndedError
from logs.errors import JournalWriteError
from logs.journal.events import AnyEvent, Entry, Phase, SensorVerdict
from logs.journal.state import PlannedEntry, SessionState


class MemoryJournal:
    """Takes events like the journal and forgets them with the process."""

    def __init__(self) -> None:
        self._last = 0
        self._open = True

    def append(self, event: AnyEvent) -> Entry:
        """Number an event.

        Raises:
            JournalWriteError: after `close`.
        """
        if not self._open:
            raise JournalWriteError("the practice session was closed")
        self._last += 1
        return Entry(seq=self._last, time_ns=time.time_ns(), event=event)

    def close(self) -> None:
        """Take no more events."""
        self._open = False


PRACTICE_OBJECTS: Final = ("cube", "bracket", "knob")


def practice_trials(count: int = 30) -> tuple[PlannedEntry, ...]:
    """A made-up plan; the second trial of each object asks which pose is right."""
    return tuple(
        PlannedEntry(
            number=number,
            trial_id=f"practice-{number}",
            grasp_id=f"practice-{number}",
            object_name=PRACTICE_OBJECTS[number % len(PRACTICE_OBJECTS)],
        )
        for number in range(1, count + 1)
    )


@contextmanager
def practice_console(actor: Actor, *, pace: float = 0.6) -> Iterator[Console]:
    """A console whose station exists only in time: it waits, and asks, and stores nothing.

    Args:
        actor: who practices.
        pace: seconds that each of the robot's phases takes.
    """
    controller = SessionController(MemoryJournal(), SessionState(practice_trials()))
    for light in ("robot", "camera"):
        controller.set_light(light, ok=True, text="practice")
    loop = threading.Thread(target=_run_loop, args=(controller, pace), name="practice")
    loop.start()
    try:
        yield Console(controller, actor, title="practice", practice=True)
    finally:
        controller.request_end()
        loop.join()
        controller.close("ended")


def _run_loop(controller: SessionController, pace: float) -> None:
    try:
        while (work := controller.next_work()) is not None:
            take = controller.begin(work)
            try:
                _run_take(controller, take, pace)
            except TakeEndedError:
                continue
    except SessionEndingError:
        return


def _run_take(controller: SessionController, take: Take, pace: float) -> None:
    if not take.executed:
        take.wait_placed()
        take.advance(Phase.CAPTURE)
        _pass_time(controller, pace)
        take.advance(Phase.REGISTER)
        _pass_time(controller, pace)
        if take.trial_id.endswith("2") and take.confirm_pose({"rivals": [{}]}) is None:
            take.void("the object is put down again")
            return
        take.advance(Phase.EXECUTE)
        _pass_time(controller, 2 * pace)
        take.record_executed("practice", SensorVerdict(lifted=None))
    take.await_label()
    take.reset()
    _pass_time(controller, pace)


def _pass_time(controller: SessionController, seconds: float) -> None:
    """Let time pass, unless the session is to end."""
    controller.wait_until(lambda: False, timeout=seconds)
