"""The simulated controller: what arm and hand share of being connected, stopped, or in error."""

from __future__ import annotations

from collection.cell.simulation import Simulation
from collection.clock import NANOSECONDS
from collection.errors import (
    ConnectionLostError,
    EmergencyStopError,
    NotConnectedError,
    RobotError,
    StoppedError,
)
from collection.robots.readings import ArmState
from collection.robots.stop_latch import STOPPED, StopLatch


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
        self._latch = StopLatch()

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
            StoppedError: the operator's stop stands.
            RobotError: the error that has not been cleared.
        """
        if user not in self._users:
            raise NotConnectedError(f"the simulated {user} is not connected: call connect()")
        self._latch.refuse()
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
        """Stop every motion until the stop is released, from any thread."""
        self._latch.press()

    def release_stop(self) -> None:
        """Take the stop back; like a real one, the controller then wants its error cleared."""
        if self._latch.stands and (self._error is None or isinstance(self._error, StoppedError)):
            self._error = StoppedError("was stopped; clear the error to go on")
        self._latch.release()

    def halt(self) -> None:
        """End every motion; there is none, while the caller has the only thread that moves."""
        if self._error is None:
            self._error = StoppedError("stopped after a failure; clear the error to go on")

    def heed_stop(self) -> None:
        """End a motion under way if the operator stopped it.

        Raises:
            StoppedError: the stop stands.
        """
        if self._latch.stands:
            raise self.fail(StoppedError(STOPPED))

    def clear(self) -> None:
        """Forget the error; a stop stands until it is released.

        Raises:
            EmergencyStopError: the emergency stop is still pressed.
            StoppedError: the operator's stop stands.
        """
        if self._emergency():
            raise EmergencyStopError("the emergency stop is still pressed; release it first")
        self._released_ns = None
        self._latch.refuse()
        self._error = None

    def state(self, user: str) -> ArmState:
        """What the controller says of itself."""
        emergency = self._emergency()
        return ArmState(
            connected=self.connected(user),
            motors_on=not emergency,
            automatic=True,
            emergency_stop=emergency,
            error=STOPPED if self._latch.stands else str(self._error) if self._error else None,
        )

    def _emergency(self) -> bool:
        released = self._released_ns
        return released is not None and self.simulation.clock.now_ns() < released
