"""What arm and hand share: the sessions with the controller, start, stop and recovery."""

from __future__ import annotations

import re
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from importlib.resources import files

from collection.clock import Clock
from collection.errors import (
    ConnectionLostError,
    MotorsOffError,
    NotConnectedError,
    RobotError,
)
from collection.robots.stop_latch import StopLatch
from collection.robots.yumi.config import YumiConfig
from collection.robots.yumi.controller_lock import ControllerLock
from collection.robots.yumi.diagnosis import not_ready
from collection.robots.yumi.program import VERSION, RapidProgram
from collection.robots.yumi.web_services import ControllerState, WebServices

MODULE_FILE = "reach_trials.mod"
PING_TIMEOUT = 5.0
"""An idle program answers within a few polls [s]."""


class ControllerLink:
    """The connection to one arm's program; arm and hand each hold it while connected.

    A second session is kept for stopping alone, so that a stop never waits for a reading.

    Args:
        config: the robot's section of the station file.
        clock: of the station.
    """

    def __init__(self, config: YumiConfig, clock: Clock) -> None:
        self.config, self.clock = config, clock
        self.task, self.unit = config.task, config.mechanical_unit
        self.services = self._session()
        self.latch = StopLatch()
        self.program = RapidProgram(
            self.services, self.task, clock, config.poll_interval, self.latch
        )
        self._stop_line = self._session()
        self._stop_lock = threading.Lock()
        self._lock: ControllerLock | None = None
        self._holders: set[str] = set()
        self._connecting = False

    def held_by(self, holder: str) -> bool:
        """Whether a device is connected."""
        return holder in self._holders

    def connect(self, holder: str) -> None:
        """Open the sessions, check that the controller is ready, start the program if it rests.

        A device that connects again has everything opened anew.

        Raises:
            NotInAutoError, MotorsOffError, EmergencyStopError: a person has to act first.
            ConnectionLostError: the controller does not answer.
            ControllerTakenError: another process leads the arm.
            StoppedError: the operator's stop stands; the program is not started.
            RobotError: our module is not loaded, in another version, or its task is inactive.
        """
        if not self._holders or holder in self._holders:
            self._connecting = True
            try:
                if self._lock is None:
                    self._lock = ControllerLock(self.config.url, self.task)
                self._close()
                self._open()
            except BaseException:
                self._close()
                self._let_go()
                raise
            finally:
                self._connecting = False
        self._holders.add(holder)

    def disconnect(self, holder: str) -> None:
        """Let go; the sessions close with the last device."""
        self._holders.discard(holder)
        if not self._holders:
            self._close()
            self._let_go()

    def require(self, holder: str) -> RapidProgram:
        """The program, for a command of a connected device.

        Raises:
            NotConnectedError: the device is not connected.
        """
        if holder not in self._holders:
            raise NotConnectedError(f"{holder} is not connected: call connect() first")
        return self.program

    def state(self) -> ControllerState:
        """Mode, motors and execution, opening a session for the question if there is none.

        Raises:
            ConnectionLostError: the controller does not answer.
        """
        with self.session() as services:
            return services.state()

    @contextmanager
    def session(self) -> Iterator[WebServices]:
        """The open session, or one for the moment: readings need no running program.

        Raises:
            ConnectionLostError: the controller does not answer.
        """
        if self._holders:
            yield self.services
            return
        passing = self._session()
        passing.connect()
        try:
            yield passing
        finally:
            passing.close()

    def stop(self) -> None:
        """Stop all programs and with them all motion, and refuse every request until released.

        While nobody is connected no program of ours is followed, and only the refusal counts.

        Raises:
            ConnectionLostError: the stop did not reach the controller, tried twice.
        """
        self.latch.press()
        self.halt()

    def release_stop(self) -> None:
        """Take the stop back; the program rests until `recover` or `connect` starts it."""
        self.latch.release()

    def halt(self) -> None:
        """Stop all programs and with them all motion; nothing to do when disconnected.

        Also between two sessions: a motion may still be under way that the last one began.

        Raises:
            ConnectionLostError: it did not reach the controller, tried twice.
        """
        with self._stop_lock:
            if not (self._holders or self._connecting):
                return
            try:
                self._stop_line.connect()
                self._stop_line.stop_programs()
            except ConnectionLostError:
                self._stop_line.reconnect()
                self._stop_line.stop_programs()

    def recover(self) -> None:
        """Bring the program back after a halt: motors on, pointer to main, start; moves nothing.

        Raises:
            StoppedError: the operator's stop stands.
            RobotError: what only a person can clear (emergency stop, manual mode).
        """
        self.latch.refuse()
        reason = not_ready(self.services.state())
        if isinstance(reason, MotorsOffError):
            self.services.motors_on()
            reason = not_ready(self.services.state())
        if reason is not None:
            raise reason
        self._restart()

    def _open(self) -> None:
        self.services.connect()
        state = self.services.state()
        reason = not_ready(state)
        if reason is not None:
            raise reason
        self._check_module()
        with self._stop_lock:
            self._stop_line.connect()
            self._stop_line.is_running()  # signs it in, so that a stop is one request
        if state.running:
            self.program.synchronize()
            self.program.ping(PING_TIMEOUT)
        else:
            self._restart()

    def _restart(self) -> None:
        self.latch.refuse()
        self.services.restart_programs()
        if self.latch.stands:  # pressed meanwhile: its request may have come before the start
            self.services.stop_programs()
        self.latch.refuse()
        self.clock.sleep(self.config.poll_interval)  # main takes note of what it will not serve
        self.program.synchronize()
        self.program.ping(PING_TIMEOUT)

    def _check_module(self) -> None:
        tasks = self.services.tasks()
        if self.task not in tasks:
            raise RobotError(
                f"the controller has no motion task {self.task}; it has: {_list(tasks)}"
            )
        if not tasks[self.task]:
            raise RobotError(f"the task {self.task} is not active: activate it on the pendant")
        try:
            loaded = self.program.version()
        except ConnectionLostError:
            raise
        except RobotError as error:
            raise RobotError(
                f"the module {MODULE_FILE} is not loaded in {self.task}, see docs/hardware.md: {error}"
            ) from error
        if loaded != module_version():
            raise RobotError(
                f"{self.task} holds {MODULE_FILE} in version {loaded}, this is {module_version()}:"
                " load the new one"
            )

    def _close(self) -> None:
        self.services.close()
        with self._stop_lock:
            self._stop_line.close()

    def _let_go(self) -> None:
        if self._lock is not None and not self._holders:
            self._lock.release()
            self._lock = None

    def _session(self) -> WebServices:
        config = self.config
        return WebServices(
            config.url, config.user, config.password.get_secret_value(), config.request_timeout
        )


def module_text() -> str:
    """The RAPID module to load into the controller."""
    return (files("collection.robots.yumi") / MODULE_FILE).read_text(encoding="ascii")


def module_version() -> str:
    """Version that the packaged module states."""
    found = re.search(rf'{VERSION}:="([^"]*)"', module_text())
    assert found is not None, f"{MODULE_FILE} states no version"
    return found.group(1)


def _list(names: dict[str, bool]) -> str:
    return ", ".join(sorted(names)) or "none"
