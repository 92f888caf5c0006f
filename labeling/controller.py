"""The session's only writer: takes commands from consoles, and leads the session's loop.

Two sides meet here. Consoles *submit* commands and read the state; the loop, in its own thread,
asks for the next work and waits for the operator. Both see one state, the fold of the journal,
under one lock; an event is on the disk before anyone is told of it.
"""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Final, Literal, Protocol

from pydantic import ValidationError

from labeling.commands import (
    VALUE_MODELS,
    Actor,
    Answer,
    AnswerStatus,
    Command,
    CommandKind,
    Value,
)
from labeling.errors import SessionEndingError
from labeling.rules import NEEDS_REVISION, TRIAL_KINDS, RefusedError, event_of
from labeling.stop_count import StopCount
from labeling.take import Take
from logs.errors import DiskFullError, JournalWriteError
from logs.journal import events as ev
from logs.journal.events import AnyEvent, Entry
from logs.journal.state import SessionState, TrialState

COMMAND_AGE_LIMIT: Final = 2.0
"""Seconds after which a command is refused: a thawed server finds old ones in its sockets."""


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
        clock: seconds, monotonic; also runs while the process is frozen.
        trials_left: how many more trials fit on the disk.
        disk_minimum: fewer than this many end the session.
        disk_warning: fewer than this many are shown as a warning.
    """

    def __init__(
        self,
        journal: EventSink,
        state: SessionState,
        *,
        stop: Callable[[], None] = lambda: None,
        clock: Callable[[], float] = time.monotonic,
        trials_left: Callable[[], int] | None = None,
        disk_minimum: int = 2,
        disk_warning: int = 50,
    ) -> None:
        self._journal = journal
        self._state = state
        self._stop_robot = stop
        self._release_robot: Callable[[], None] = lambda: None
        self._stopping = StopCount()
        self._clock = clock
        self._trials_left = trials_left
        self._disk_minimum = disk_minimum
        self._disk_warning = disk_warning
        self.disk_left = trials_left() if trials_left else None
        self.lights: dict[str, tuple[bool, str]] = {}
        self._changed = threading.Condition(threading.RLock())
        self._listening = threading.Lock()
        self._listeners: tuple[Callable[[], None], ...] = ()
        self._ending = False
        self._closed = False
        self._version = 0

    # -- consoles -------------------------------------------------------------------------

    def submit(self, command: Command, actor: Actor) -> Answer:
        """Act upon a command; thread-safe.

        A stop acts before anything else happens: before the lock, the checks and the log.
        """
        if command.kind is not CommandKind.STOP:
            with self._changed:
                return self._decide(command, actor)
        with self._stopping.pressed():
            trouble = self._stop_now()
            with self._changed:
                answer = self._decide(command, actor)
        self.announce()  # a stop that could not be stored is over, too
        return answer.model_copy(update={"message": trouble}) if trouble else answer

    @contextmanager
    def reading(self) -> Iterator[SessionState]:
        """The state, which stays as it is while the context lasts."""
        with self._changed:
            yield self._state

    def tick(self) -> float:
        """The server's monotonic clock [s], for the stream; commands echo it."""
        return self._clock()

    @property
    def version(self) -> int:
        """Grows with everything a console would show."""
        return self._version

    def wait_version(self, seen: int, timeout: float | None = None) -> int:
        """Wait until there is something newer than `seen`; returns the version now."""
        with self._changed:
            self._changed.wait_for(lambda: self._version != seen or self._closed, timeout)
            return self._version

    def listen(self, listener: Callable[[], None]) -> Callable[[], None]:
        """Call a function after every change, from any thread; returns how to end that."""
        # A lock of its own: whoever comes or goes never waits for the disk.
        with self._listening:
            self._listeners = (*self._listeners, listener)

        def forget() -> None:
            with self._listening:
                self._listeners = tuple(one for one in self._listeners if one is not listener)

        return forget

    @property
    def disk_low(self) -> bool:
        """True if the operator should make room on the disk."""
        return self.disk_left is not None and self.disk_left < self._disk_warning

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
        with self._changed:
            self._release_robot = release

    def next_work(self) -> TrialState | None:
        """The trial to attend to, or None when nothing is left or the session is to end.

        Waits while the session is paused, held or stopped. A trial whose status is
        `unlabelled` has been executed: it only waits for its label.

        Raises:
            DiskFullError: if the next trial may not fit on the disk.
        """
        with self._changed:
            self._changed.wait_for(lambda: self._ending or self.may_move)
            if self._ending:
                return None
            work = self._state.next_work()
        if work is not None and work.status != "unlabelled":
            self._guard_disk()
        return work

    def begin(self, work: TrialState) -> Take:
        """Begin a new take of a trial, or return to the executed take that lacks its label."""
        with self._changed:
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
        with self._changed:
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
        with self._changed:
            self._changed.wait_for(lambda: self._ending or condition(), timeout)
            if self._ending and not condition():
                raise SessionEndingError("the session is ending")

    def hold(self, cause: str, text: str) -> None:
        """Start nothing new until the cause is released; the robot finishes safely."""
        with self._changed:
            if self._state.holds.get(cause) != text and not self._closed:
                self.record(ev.Held(cause=cause, text=text))

    def release(self, cause: str) -> None:
        """The cause of a hold is gone."""
        with self._changed:
            if cause in self._state.holds and not self._closed:
                self.record(ev.Released(cause=cause))

    def set_light(self, name: str, ok: bool, text: str = "") -> None:
        """Show the health of the robot or the camera; not an event."""
        with self._changed:
            if self.lights.get(name) != (ok, text):
                self.lights[name] = (ok, text)
                self.announce()

    def request_end(self) -> None:
        """Ask the loop to end: its waits return at once, the robot finishes its motion."""
        with self._changed:
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
        with self._changed:
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
        with self._changed:
            self._version += 1
            self._changed.notify_all()
            for listener in self._listeners:
                listener()

    # -- inside ---------------------------------------------------------------------------

    def _stop_now(self) -> str:
        try:
            self._stop_robot()
        except Exception as error:  # the operator must learn of it, whatever it was
            return f"THE STOP DID NOT REACH THE ROBOT ({error}): use the hardware stop"
        return ""

    def _guard_disk(self) -> None:
        if self._trials_left is None:
            return
        left = self._trials_left()
        with self._changed:
            self.disk_left = left
        if left < self._disk_minimum:
            raise DiskFullError(
                f"room for {left} more trials is left on the session's disk, fewer than"
                f" {self._disk_minimum}: free some, then continue with --resume"
            )

    def _decide(self, command: Command, actor: Actor) -> Answer:
        known = self._state.commands.get(command.id)
        # A stop that is sent again has stopped the robot again: it stands until it is cleared.
        stops_again = command.kind is CommandKind.STOP and not self._state.stopped
        if known is not None and not stops_again:
            rev = self._revision(command)
            return Answer(status=AnswerStatus.DUPLICATE, rev=rev, seq=known.seq)
        if self._closed:
            return self._no(command, AnswerStatus.REJECTED, "the session has ended")
        if command.kind in TRIAL_KINDS and command.trial_id not in self._state.trials:
            return self._no(command, AnswerStatus.REJECTED, f"no trial {command.trial_id!r} here")
        why_stale = self._staleness(command)
        if why_stale:
            return self._no(command, AnswerStatus.STALE, why_stale)
        try:
            value = VALUE_MODELS[command.kind].model_validate(command.value)
            blind = self._is_blind(command, value, actor)
            event = event_of(self._state, command, value, actor, blind=blind)
            entry = self.record(event)
            if command.kind is CommandKind.CLEAR_STOP:
                self._stopping.unless_pressed(self._release_robot)
        except ValidationError as error:
            return self._no(command, AnswerStatus.REJECTED, _first_problem(error))
        except (RefusedError, JournalWriteError) as error:
            return self._no(command, AnswerStatus.REJECTED, str(error))
        return Answer(status=AnswerStatus.STORED, rev=self._revision(command), seq=entry.seq)

    def _staleness(self, command: Command) -> str:
        if command.kind is CommandKind.STOP:
            return ""
        if command.tick is not None and self._clock() - command.tick > COMMAND_AGE_LIMIT:
            return f"the command is older than {COMMAND_AGE_LIMIT:g} s"
        if command.kind in NEEDS_REVISION and command.rev != self._revision(command):
            return "something changed since this was on the screen; look again"
        return ""

    def _is_blind(self, command: Command, value: Value, actor: Actor) -> bool:
        if getattr(value, "found_by", None) == "disagreement":
            return False
        trial = self._state.trials.get(command.trial_id or "")
        return trial is None or actor.operator not in self._state.shown_to(trial)

    def _revision(self, command: Command) -> int:
        trial = self._state.trials.get(command.trial_id or "")
        return trial.rev if trial and command.kind in TRIAL_KINDS else self._state.control_rev

    def _no(self, command: Command, status: AnswerStatus, message: str) -> Answer:
        return Answer(status=status, rev=self._revision(command), message=message)


def _first_problem(error: ValidationError) -> str:
    problem = error.errors()[0]
    where = ".".join(map(str, problem["loc"]))
    message = str(problem["msg"]).removeprefix("Value error, ")
    return f"{where}: {message}" if where else message
