"""What a trial asks of an arm and of a gripper, whichever maker's they are.

Constructors are inert; `connect()` talks to the hardware; both are context managers. What a
device offers (limits, shape, name) can be read while it is disconnected. A command blocks until
it is done, returns what was really executed with its times, and raises a typed
[RobotError][collection.errors.RobotError] otherwise. Joints are in *kinematic* order (on the YuMi
1, 2, 7, 3, 4, 5, 6), [rad]; poses are of the gripper's frame in the station's world.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from enum import StrEnum
from typing import Protocol, Self

from collection.robots.description import RobotDescription
from collection.robots.readings import (
    ArmListener,
    ArmState,
    GripperListener,
    GripperMotion,
    GripperSample,
    GripperState,
    Motion,
)
from reach.arrays import BoolArray, FloatArray
from reach.gripper import ParallelJawGripper


class Path(StrEnum):
    """How the gripper travels to a pose: along a line in space, or straight in joint space."""

    LINEAR = "linear"
    JOINT = "joint"


@dataclass(frozen=True, slots=True)
class Speed:
    """Speed of a motion; the slower of the two limits counts.

    Args:
        linear: of the gripper [m/s].
        angular: of the gripper [rad/s].
        joint: share of each joint's maximal speed, in (0, 1].
    """

    linear: float
    angular: float = 1.0
    joint: float = 0.5


@dataclass(frozen=True, slots=True, eq=False)
class Waypoint:
    """One step of a planned motion, for the dry run.

    Args:
        name: what the step is for (`approach`, `lift`, ...).
        T_world_gripper: where it ends, shape (4, 4).
        path: how it gets there.
        opening: of the jaws meanwhile [m]; fully open if None.
    """

    name: str
    T_world_gripper: FloatArray
    path: Path = Path.LINEAR
    opening: float | None = None


class Arm(Protocol):
    """An arm that carries the gripper."""

    @property
    def name(self) -> str:
        """Of the arm, for logs."""
        ...

    @property
    def description(self) -> RobotDescription:
        """Limits and shape; readable while disconnected."""
        ...

    def connect(self) -> None:
        """Reach the controller and check that it is ready; moves nothing."""
        ...

    def disconnect(self) -> None:
        """Let go of the controller; allowed at any time, more than once."""
        ...

    def __enter__(self) -> Self: ...

    def __exit__(self, *exception: object) -> None: ...

    def state(self) -> ArmState:
        """What the controller says of itself; never raises for a robot that is merely not ready."""
        ...

    def joints(self) -> FloatArray:
        """Measured joints, shape (J,) [rad]."""
        ...

    def pose(self) -> FloatArray:
        """Measured T_world_gripper, shape (4, 4)."""
        ...

    def move_to_joints(
        self, joints: FloatArray, *, speed: Speed, on_sample: ArmListener | None = None
    ) -> Motion:
        """Move straight in joint space.

        Raises:
            JointLimitError: a target lies outside its limits; nothing moved.
        """
        ...

    def move_to_pose(
        self,
        T_world_gripper: FloatArray,
        *,
        path: Path = Path.LINEAR,
        speed: Speed,
        zone: float = 0.0,
        guarded: bool = False,
        on_sample: ArmListener | None = None,
    ) -> Motion:
        """Move the gripper's frame to a pose.

        Args:
            T_world_gripper: target, shape (4, 4).
            path: along a line, or straight in joint space.
            speed: at most this fast.
            zone: how near the target the motion may blend into the next [m]; 0 stops there. A
                permission: an arm may stop at every pose, and the simulated one does.
            guarded: stop at a light touch, not only at a hard collision.
            on_sample: called with readings while moving.

        Raises:
            UnreachableError: no configuration reaches it; nothing moved.
            CollisionStopError: stopped by a contact.
        """
        ...

    def home(self, *, speed: Speed, on_sample: ArmListener | None = None) -> Motion:
        """Move to the home configuration."""
        ...

    def stop(self) -> None:
        """The operator's stop: end any motion now, and refuse every command until `release_stop`.

        Safe to call at any time, from any thread, and when disconnected.

        Raises:
            ConnectionLostError: it did not reach the robot; commands are refused all the same.
        """
        ...

    def release_stop(self) -> None:
        """Take `stop` back, on the word of a person; moves nothing, and clears no error."""
        ...

    def halt(self) -> None:
        """End any motion now; `clear_error` makes the arm follow again.

        Raises:
            ConnectionLostError: it did not reach the robot.
        """
        ...

    def clear_error(self) -> None:
        """Acknowledge a halt or error so that commands are accepted again.

        Raises:
            StoppedError: the operator's stop stands; only `release_stop` ends it.
            RobotError: if only a person can clear it (emergency stop, manual mode).
        """
        ...

    def reachable(self, T_world_gripper: FloatArray) -> BoolArray:
        """Which gripper poses (N, 4, 4) the arm reaches within its limits, clear of the table."""
        ...

    def check(self, waypoints: Sequence[Waypoint]) -> None:
        """Dry run from the present configuration: reach, limits, table and self collision.

        Raises:
            UnreachableError: a waypoint, or a point of a line to it, is out of reach.
            UnsafeMotionError: the path touches the table or the robot itself.
        """
        ...

    def link_transforms(self, joints: FloatArray) -> Mapping[str, FloatArray]:
        """Forward kinematics: T_world_link (4, 4) of every link of `description`, and `gripper`."""
        ...


class GripperDevice(Protocol):
    """A parallel-jaw hand."""

    @property
    def name(self) -> str:
        """Of the hand, for logs."""
        ...

    @property
    def geometry(self) -> ParallelJawGripper:
        """Pads, stroke, force and solids; readable while disconnected."""
        ...

    def connect(self) -> None:
        """Reach the hand; moves nothing."""
        ...

    def disconnect(self) -> None:
        """Let go of the hand; allowed at any time, more than once."""
        ...

    def __enter__(self) -> Self: ...

    def __exit__(self, *exception: object) -> None: ...

    def state(self) -> GripperState:
        """What the hand says of itself."""
        ...

    def calibrate(self) -> GripperMotion:
        """Find the jaws' zero by closing them; nothing may be between the jaws."""
        ...

    def open(
        self, width: float | None = None, *, on_sample: GripperListener | None = None
    ) -> GripperMotion:
        """Open to a width [m]; fully if None.

        Raises:
            GripperNotCalibratedError: the hand does not know where its jaws are.
        """
        ...

    def close(self, force: float, *, on_sample: GripperListener | None = None) -> GripperMotion:
        """Close with a force [N] until the jaws rest on something, or on each other.

        Raises:
            GripperNotCalibratedError: the hand does not know where its jaws are.
        """
        ...

    def read(self) -> GripperSample:
        """Read width and force."""
        ...

    def stop(self) -> None:
        """The operator's stop, of the whole robot: the jaws stay where they are, still holding."""
        ...

    def halt(self) -> None:
        """Stop the jaws where they are, still holding; the arm's `clear_error` ends it."""
        ...
