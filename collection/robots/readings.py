"""What a robot tells of itself: readings while it moves, what a motion came to, and its state.

Joints are in *kinematic* order, [rad]; poses are of the gripper's frame in the station's world.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from reach.arrays import FloatArray


@dataclass(frozen=True, slots=True, eq=False)
class ArmSample:
    """One reading of the arm: time [ns], joints (J,) [rad], measured T_world_gripper (4, 4)."""

    time_ns: int
    joints: FloatArray
    T_world_gripper: FloatArray


@dataclass(frozen=True, slots=True)
class GripperSample:
    """One reading of the hand: time [ns], distance of the pads' faces [m], grip force [N]."""

    time_ns: int
    width: float
    force: float


@dataclass(frozen=True, slots=True, eq=False)
class Motion:
    """An executed motion of the arm: when, and where it measured itself to be at the end."""

    start_ns: int
    end_ns: int
    joints: FloatArray
    T_world_gripper: FloatArray


@dataclass(frozen=True, slots=True)
class GripperMotion:
    """An executed motion of the jaws; width [m] and force [N] as read at its end."""

    start_ns: int
    end_ns: int
    width: float
    force: float


@dataclass(frozen=True, slots=True)
class ArmState:
    """What the controller says of itself; a diagnosis reads it, a trial checks `ready`."""

    connected: bool
    motors_on: bool
    automatic: bool
    emergency_stop: bool = False
    error: str | None = None

    @property
    def ready(self) -> bool:
        """Whether the arm will follow a command."""
        healthy = not self.emergency_stop and self.error is None
        return self.connected and self.motors_on and self.automatic and healthy


@dataclass(frozen=True, slots=True)
class GripperState:
    """What the hand says of itself."""

    connected: bool
    calibrated: bool
    error: str | None = None


ArmListener = Callable[[ArmSample], None]
GripperListener = Callable[[GripperSample], None]
