"""What every arm shares whose motions are planned on this computer."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, ClassVar, Self

import numpy as np

from collection.errors import JointLimitError
from collection.robots.description import RobotDescription
from collection.robots.protocol import Speed, Waypoint
from collection.robots.readings import ArmListener, Motion
from reach.arrays import BoolArray, FloatArray

if TYPE_CHECKING:
    from collection.robots.planner import ArmPlanner, JointPath

ON_A_LIMIT = 1e-9
"""A joint beyond its limit by less is on it [rad]."""


class PlannedArm(ABC):
    """An arm that dry-runs its motions with a planner and executes what was checked."""

    same_start: ClassVar[float]
    """A checked motion is executed from where it was checked, up to this much [rad]."""

    def __init__(self) -> None:
        self._checked: list[tuple[Waypoint, JointPath]] = []

    @property
    @abstractmethod
    def _planner(self) -> ArmPlanner:
        """Of this arm in its cell."""

    @property
    @abstractmethod
    def _start(self) -> FloatArray:
        """Where motions start from now, shape (J,) [rad]."""

    @abstractmethod
    def connect(self) -> None:
        """Reach the controller and check that it is ready; moves nothing."""

    @abstractmethod
    def disconnect(self) -> None:
        """Let go of the controller; allowed at any time, more than once."""

    @abstractmethod
    def move_to_joints(
        self, joints: FloatArray, *, speed: Speed, on_sample: ArmListener | None = None
    ) -> Motion:
        """Move straight in joint space; see the protocol."""

    def __enter__(self) -> Self:
        self.connect()
        return self

    def __exit__(self, *exception: object) -> None:
        self.disconnect()

    @property
    def description(self) -> RobotDescription:
        """Limits and shape; readable while disconnected."""
        return self._planner.description

    def home(self, *, speed: Speed, on_sample: ArmListener | None = None) -> Motion:
        """Move to the home configuration, around what is in the way.

        Raises:
            UnsafeMotionError: no way there was found; nothing moved.
        """
        from collection.robots.detour import detour

        legs = [
            self.move_to_joints(path.joints[-1], speed=speed, on_sample=on_sample)
            for path in detour(self._planner, self._start, self.description.home)
        ]
        return replace(legs[-1], start_ns=legs[0].start_ns)

    def reachable(self, T_world_gripper: FloatArray) -> BoolArray:
        """Which gripper poses (N, 4, 4) the arm reaches within its limits, clear of the table."""
        return self._planner.reachable(T_world_gripper)

    def check(self, waypoints: Sequence[Waypoint]) -> None:
        """Dry run from the present configuration; its paths are kept for the motions to come.

        Raises:
            UnreachableError: a waypoint, or a point of a line to it, is out of reach.
            UnsafeMotionError: every way found touches the table or the robot itself.
        """
        paths = self._planner.plan(waypoints, self._start)
        self._checked = list(zip(waypoints, paths, strict=True))

    def link_transforms(self, joints: FloatArray) -> Mapping[str, FloatArray]:
        """Forward kinematics: T_world_link (4, 4) of every link, and `gripper`."""
        return self._planner.link_transforms(joints)

    def _path_to(self, waypoint: Waypoint, start: FloatArray) -> JointPath:
        """The checked path to a waypoint, or one planned from a configuration (J,) now."""
        for planned, path in self._checked:
            same_goal = planned.path is waypoint.path and np.array_equal(
                planned.T_world_gripper, waypoint.T_world_gripper
            )
            if same_goal and np.abs(path.joints[0] - start).max() < self.same_start:
                return path
        return self._planner.plan([waypoint], start)[0]

    def _refuse_outside_limits(self, joints: FloatArray) -> None:
        about = self.description
        for name, value, low, high in zip(
            about.joint_names, joints, about.lower, about.upper, strict=True
        ):
            if not low - ON_A_LIMIT <= value <= high + ON_A_LIMIT:
                raise JointLimitError(
                    f"{name} cannot go to {value:.4f} rad: limits {low:.4f} to {high:.4f}"
                )
