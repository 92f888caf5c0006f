"""Requests to the RAPID program of one arm, each served once however often the line breaks."""

from __future__ import annotations

import threading
from collections.abc import Callable
from itertools import count
from typing import NoReturn

from collection.clock import NANOSECONDS, Clock
from collection.errors import (
    ConnectionLostError,
    DeviceError,
    RobotError,
    RobotTimeoutError,
    StoppedError,
)
from collection.robots.stop_latch import STOPPED, StopLatch
from collection.robots.yumi.diagnosis import newest_event, stop_reason
from collection.robots.yumi.messages import (
    Command,
    Reply,
    Request,
    next_sequence,
    raise_failure,
    readable_jaw,
)
from collection.robots.yumi.rapid_text import from_rapid
from collection.robots.yumi.web_services import WebServices

REQUEST, REPLY, JAW = "reach_request", "reach_reply", "reach_jaw"
VERSION, TOOL = "reach_version", "reach_tool"

LOOKS_PER_STATE = 4
"""Looks at the reply for one at whether the program still runs."""


class RapidProgram:
    """The program in one arm's task.

    Args:
        services: session with the controller.
        task: name of the RAPID task, `T_ROB_R` or `T_ROB_L`.
        clock: for waiting between two looks at the reply.
        poll_interval: time between them [s].
        latch: the operator's stop; while it stands no request is sent.
    """

    def __init__(
        self,
        services: WebServices,
        task: str,
        clock: Clock,
        poll_interval: float,
        latch: StopLatch,
    ) -> None:
        self.task = task
        self._latch = latch
        self._services, self._clock, self._poll_interval = services, clock, poll_interval
        self._lock = threading.Lock()
        self._serving = False
        self._sequence = 0
        self._last_event = 0

    def version(self) -> str:
        """Version of the module that is loaded."""
        return str(from_rapid(self._services.read(self.task, VERSION)))

    def synchronize(self) -> None:
        """Take up the sequence numbers and the event log where they are."""
        self._sequence = max(self._asked(), self.reply().sequence)
        self._last_event = newest_event(self._services)

    def reply(self) -> Reply:
        """The program's latest reply."""
        return Reply.from_rapid(self._services.read(self.task, REPLY))

    def serve(
        self, request: Request, *, timeout: float, meanwhile: Callable[[], None] | None = None
    ) -> Reply:
        """Have a request served and wait until it is done.

        If the line breaks, the session is opened anew and the same request is taken up once: the
        program knows it by its sequence number and does not serve it twice.

        Args:
            request: what to do.
            timeout: longest time it may take [s].
            meanwhile: called at every look at the reply.

        Raises:
            StoppedError: the operator's stop stands, or is pressed meanwhile.
            ConnectionLostError: the line broke twice.
            RobotTimeoutError: not done in time; the programs were stopped.
            RobotError: or one of its kinds: what the program or the controller reports.
        """
        with self._lock:
            self._sequence = sequence = next_sequence(self._sequence)
            self._serving = True
            try:
                self._send(request, sequence)
                reply = self._wait(request, sequence, timeout, meanwhile)
            except ConnectionLostError:
                reply = self._resume(request, sequence, timeout, meanwhile)
            finally:
                self._serving = False
        if reply.failure:
            self._last_event = newest_event(self._services)
        raise_failure(request, reply.failure)
        return reply

    def jaw_mm(self) -> float:
        """Position of one jaw [mm], at most 0.1 s old; also while a request is served.

        Raises:
            RobotError: the program does not run, or cannot read the hand.
        """
        value = from_rapid(self._services.read(self.task, JAW))
        if not self._serving and not self._services.is_running():
            raise self._stopped()
        return readable_jaw(value if isinstance(value, float) else -1.0)

    def ping(self, timeout: float) -> Reply:
        """Ask for nothing: the reply tells that the program runs, and the state of the hand."""
        return self.serve(Request(Command.PING), timeout=timeout)

    def _asked(self) -> int:
        match from_rapid(self._services.read(self.task, REQUEST)):
            case [float(sequence), *_]:
                return int(sequence)
        raise RobotError(f"{REQUEST} in {self.task} has no sequence number: load this module")

    def _send(self, request: Request, sequence: int) -> None:
        self._latch.refuse()
        self._services.write(self.task, REQUEST, request.to_rapid(sequence))

    def _resume(
        self,
        request: Request,
        sequence: int,
        timeout: float,
        meanwhile: Callable[[], None] | None,
    ) -> Reply:
        self._services.reconnect()
        if self._asked() != sequence:
            self._send(request, sequence)
        return self._wait(request, sequence, timeout, meanwhile)

    def _wait(
        self,
        request: Request,
        sequence: int,
        timeout: float,
        meanwhile: Callable[[], None] | None,
    ) -> Reply:
        deadline = self._clock.now_ns() + round(timeout * NANOSECONDS)
        looks = count()
        while True:
            self._clock.sleep(self._poll_interval)
            if self._latch.stands:
                self._services.stop_programs()  # here too: the stop's own line may be cut
                self._latch.refuse()
            reply = self.reply()
            if reply.done and reply.sequence == sequence:
                return reply
            if next(looks) % LOOKS_PER_STATE == 0 and not self._services.is_running():
                raise self._stopped()
            if self._clock.now_ns() > deadline:
                self._give_up(request, timeout)
            if meanwhile is not None:
                meanwhile()

    def _stopped(self) -> DeviceError:
        if self._latch.stands:
            return StoppedError(STOPPED)
        reason = stop_reason(self._services, self._last_event)
        self._last_event = newest_event(self._services)
        return reason

    def _give_up(self, request: Request, timeout: float) -> NoReturn:
        self._services.stop_programs()
        raise RobotTimeoutError(
            f"{request.command.name.lower()} was not done within {timeout:.1f} s; stopped"
        )
