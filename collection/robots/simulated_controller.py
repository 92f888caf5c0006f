"""The simulated controller: what arm and hand share of being connected, stopped, or in error."""

from __future__ import annotations

import threading

from collection.clock import NANOSECONDS
from collection.errors import (
    ConnectionLostError,
    EmergencyStopError,
    NotConnectedError,
    RobotError,
    StoppedError,
)
from collection.robots.protocol import ArmState
from collection.simulation import Simulation


class SimulatedController:
    """One controller for one arm and one hand.

    Args:
        simulation: the cell it stands in.
    """

    def __init__(self, simulation: Simulation) -> None:
        self.simulation = simulation
        self._users: set[str] = set()
        self._error: RobotError | None = None
        self._released_ns: int | None = None
        self._stop = threading.Event()

    def connect(self, user: str) -> None:
        """Let a device in; a lost connection is mended."""
        self._users.add(user)
        if isinstance(self._error, ConnectionLostError):
            self._error = None

    def disconnect(self, user: str) -> None:
        """Let a device go."""
        self._users.discard(user)

    def connected(self, user: str) -> bool:
        """Whether a device is connected."""
        return user in self._users

    def require(self, user: str) -> None:
        """Refuse a command that cannot be followed.

        Raises:
            NotConnectedError: before connect().
            RobotError: the error that has not been cleared.
        """
        if user not in self._users:
            raise NotConnectedError(f"the simulated {user} is not connected: call connect()")
        if self._stop.is_set() and self._error is None:
            self._error = StoppedError("stopped; clear the error to go on")
        if self._error is not None:
            raise self._error

    def fail(self, error: RobotError) -> RobotError:
        """Enter an error state; the caller raises what is returned."""
        self._error = error
        if isinstance(error, ConnectionLostError):
            self._users.clear()
        if isinstance(error, EmergencyStopError):
            seconds = self.simulation.settings.emergency_stop_time
            now = self.simulation.clock.now_ns()
            self._released_ns = now + round(seconds * NANOSECONDS)
        return error

    def stop(self) -> None:
        """Stop every motion, from any thread."""
        self._stop.set()

    @property
    def stopping(self) -> bool:
        """Whether somebody called stop()."""
        return self._stop.is_set()

    def clear(self) -> None:
        """Forget the error.

        Raises:
            EmergencyStopError: the emergency stop is still pressed.
        """
        if self._emergency():
            raise EmergencyStopError("the emergency stop is still pressed; release it first")
        self._released_ns = None
        self._error = None
        self._stop.clear()

    def state(self, user: str) -> ArmState:
        """What the controller says of itself."""
        emergency = self._emergency()
        return ArmState(
            connected=self.connected(user),
            motors_on=not emergency,
            automatic=True,
            emergency_stop=emergency,
            error=str(self._error) if self._error else "stopped" if self._stop.is_set() else None,
        )

    def _emergency(self) -> bool:
        released = self._released_ns
        return released is not None and self.simulation.clock.now_ns() < released
