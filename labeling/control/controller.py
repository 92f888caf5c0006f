"""The session's only writer: takes commands from consoles, and leads the session's loop.

Two sides meet here. Consoles *submit* commands and read the state; the loop, in its own thread,
asks for the next work and waits for the operator. Both see one state, the fold of the journal,
under one lock; an event is on the disk before anyone is told of it.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Literal, Protocol

from labeling.control.changes import Changes
from labeling.control.commands import Actor, Answer, AnswerStatus, Command, CommandKind
from labeling.control.disk_guard import DiskGuard
from labeling.control.judging import judge, rejection, revision
from labeling.control.stop_count import StopCount
from labeling.control.take import Take
from labeling.errors import SessionEndingError
from logs.errors import JournalWriteError
from logs.journal import events as ev
from logs.journal.events import AnyEvent, Entry
from logs.journal.state import SessionState, TrialState


def uptime() -> float:
    """Seconds since the machine started, also while it or the process slept.

    A lid that was closed over a key press must not let it through when it opens: Linux's usual
    monotonic clock stands still meanwhile.
    """
    return time.clock_gettime(getattr(time, "CLOCK_BOOTTIME", time.CLOCK_MONOTONIC))


class EventSink(Protocol):
    """Where events go: the journal, or nowhere in practice mode."""

    def append(self, event: AnyEvent) -> Entry:
        """Store an event; returns once it is safe."""
        ...

    def close(self) -> None:
        """Take no more events."""
        ...


class SessionController:
    """One session's writer, state machine and meeting point.

    Args:
        journal: open journal, or a sink that stores nothing.
        state: fold of the journal's entries; the controller keeps it up to date.
        stop: halts the robot at once; called from any thread, must not wait for anything.
        clock: seconds, monotonic; also runs while the process is frozen or the machine asleep.
        trials_left: how many more trials fit on the session's disk; None if nobody needs to know.
    """

    def __init__(
        self,
        journal: EventSink,
        state: SessionState,
        *,
        stop: Callable[[], None] = lambda: None,
        clock: Callable[[], float] = uptime,
        trials_left: Callable[[], int] | None = None,
    ) -> None:
        self._journal = journal
        self._state = state
        self._stop_robot = stop
        self._release_robot: Callable[[], None] = lambda: None
        self._stopping = StopCount()
        self._clock = clock
        self.disk = DiskGuard(trials_left)
        self.lights: dict[str, tuple[bool, str]] = {}
        self._changes = Changes()
        self._ending = False
        self._closed = False

    # -- consoles -------------------------------------------------------------------------

    def submit(self, command: Command, actor: Actor) -> Answer:
        """Act upon a command; thread-safe.

        A stop acts before anything else happens: before the lock, the checks and the log.
        """
        if command.kind is not CommandKind.STOP:
            with self._changes:
                return self._decide(command, actor)
        with self._stopping.pressed():
            trouble = self._stop_now()
            with self._changes:
                answer = self._decide(command, actor)
        self.announce()  # a stop that could not be stored is over, too
        return answer.model_copy(update={"message": trouble}) if trouble else answer

    @contextmanager
    def reading(self) -> Iterator[SessionState]:
        """The state, which stays as it is while the context lasts."""
        with self._changes:
            yield self._state

    def tick(self) -> float:
        """The server's monotonic clock [s], for the stream; commands echo it."""
        return self._clock()

    @property
    def version(self) -> int:
        """Grows with everything a console would show."""
        return self._changes.version

    def wait_version(self, seen: int, timeout: float | None = None) -> int:
        """Wait until there is something newer than `seen`; returns the version now."""
        self._changes.wait_for(lambda: self.version != seen or self._closed, timeout)
        return self.version

    def listen(self, listener: Callable[[], None]) -> Callable[[], None]:
        """Call a function after every change, from any thread; returns how to end that."""
        return self._changes.listen(listener)

    @property
    def may_move(self) -> bool:
        """True unless the session is stopped, paused or held, or a stop is just being pressed."""
        state = self._state
        return not (state.stopped or state.paused or state.holds or self._stopping.under_way)

    @property
    def ending(self) -> bool:
        """True once the session is asked to end."""
        return self._ending

    @property
    def closed(self) -> bool:
        """True once the session's writer has ended."""
        return self._closed

    # -- the session's loop ---------------------------------------------------------------

    def releases_with(self, release: Callable[[], None]) -> None:
        """Name what lets the robot follow again; called only when a person clears the stop.

        Args:
            release: takes the robot's stop back; must not wait for anything.
        """
        with self._changes:
            self._release_robot = release

    def next_work(self) -> TrialState | None:
        """The trial to attend to, or None when nothing is left or the session is to end.

        Waits while the session is paused, held or stopped. A trial whose status is
        `unlabelled` has been executed: it only waits for its label.

        Raises:
            DiskFullError: if the next trial may not fit on the disk.
        """
        with self._changes:
            self._changes.wait_for(lambda: self._ending or self.may_move)
            if self._ending:
                return None
            work = self._state.next_work()
        if work is not None and work.status != "unlabelled":
            self.disk.require_room()
        return work

    def begin(self, work: TrialState) -> Take:
        """Begin a new take of a trial, or return to the executed take that lacks its label."""
        with self._changes:
            take = work.valid_take
            if take is not None:
                return Take(self, work, take)
            number = len(work.takes) + 1
            self.record(ev.TrialStarted(trial_id=work.trial_id, take=number))
            self.record(
                ev.PhaseEntered(trial_id=work.trial_id, take=number, phase=ev.Phase.PLACE_OBJECT)
            )
            return Take(self, work, work.find_take(number))

    def record(self, event: AnyEvent) -> Entry:
        """Store an event of the loop's own: a phase, an execution, a score.

        Raises:
            JournalWriteError: if it could not be stored.
        """
        with self._changes:
            entry = self._journal.append(event)
            self._state.apply(entry)
            self.announce()
            return entry

    def wait_until(self, condition: Callable[[], bool], timeout: float | None = None) -> None:
        """Wait for the operator.

        Args:
            condition: what is waited for; looked at after every change.
            timeout: give up after this many seconds.

        Raises:
            SessionEndingError: if the session is asked to end meanwhile.
        """
        with self._changes:
            self._changes.wait_for(lambda: self._ending or condition(), timeout)
            if self._ending and not condition():
                raise SessionEndingError("the session is ending")

    def hold(self, cause: str, text: str) -> None:
        """Start nothing new until the cause is released; the robot finishes safely."""
        with self._changes:
            if self._state.holds.get(cause) != text and not self._closed:
                self.record(ev.Held(cause=cause, text=text))

    def release(self, cause: str) -> None:
        """The cause of a hold is gone."""
        with self._changes:
            if cause in self._state.holds and not self._closed:
                self.record(ev.Released(cause=cause))

    def set_light(self, name: str, ok: bool, text: str = "") -> None:
        """Show the health of the robot or the camera; not an event."""
        with self._changes:
            if self.lights.get(name) != (ok, text):
                self.lights[name] = (ok, text)
                self.announce()

    def request_end(self) -> None:
        """Ask the loop to end: its waits return at once, the robot finishes its motion."""
        with self._changes:
            self._ending = True
            self.announce()

    def close(
        self, status: Literal["finished", "ended", "failed"] | None, reason: str = ""
    ) -> None:
        """End the session's writer; harmless when called twice.

        Args:
            status: how the session ended; None for a review, which is no part of it.
            reason: why, in words.
        """
        with self._changes:
            if self._closed:
                return
            self._ending = True
            try:
                if status is not None:
                    self.record(ev.SessionClosed(status=status, reason=reason))
            finally:
                self._closed = True
                self._journal.close()
                self.announce()

    def announce(self) -> None:
        """Tell everyone who waits or listens that something changed."""
        self._changes.announce()

    # -- inside ---------------------------------------------------------------------------

    def _stop_now(self) -> str:
        try:
            self._stop_robot()
        except Exception as error:  # the operator must learn of it, whatever it was
            return f"THE STOP DID NOT REACH THE ROBOT ({error}): use the hardware stop"
        return ""

    def _decide(self, command: Command, actor: Actor) -> Answer:
        state = self._state
        found = judge(state, command, actor, now=self._clock(), closed=self._closed)
        if isinstance(found, Answer):
            return found
        try:
            entry = self.record(found)
        except JournalWriteError as error:
            return rejection(state, command, str(error))
        if command.kind is CommandKind.CLEAR_STOP:
            self._stopping.unless_pressed(self._release_robot)
        return Answer(status=AnswerStatus.STORED, rev=revision(state, command), seq=entry.seq)
