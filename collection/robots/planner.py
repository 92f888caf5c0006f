"""Plans and dry-runs the arm's motions: what was checked is what is executed."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from collection.errors import RobotError, UnreachableError, UnsafeMotionError
from collection.robots.arm_model import arm_model
from collection.robots.inverse_kinematics import CollisionCheck, LineFollower
from collection.robots.protocol import Path, RobotDescription, Waypoint
from collection.robots.reach_search import solve_many, start_configurations
from collection.robots.yumi_arm import JOINT_NAMES, YumiArm, link_name
from reach.arrays import BoolArray, FloatArray, frozen
from reach.gripper import ParallelJawGripper
from reach.transforms import inverse

STARTS = 6
FURTHER_STARTS = 24
CHECK_STEP = 0.08
"""Configurations of a joint motion are checked at least this densely [rad]."""


@dataclass(frozen=True, slots=True, eq=False)
class JointPath:
    """Configurations (K, J) [rad], with the share of the motion at each (K,)."""

    joints: FloatArray
    shares: FloatArray


class ArmPlanner:
    """Reach, paths and collisions of one arm in its cell.

    Args:
        arm: kinematics and shape.
        gripper: the hand it carries.
        T_world_base: where it stands, shape (4, 4).
        table_height: world z of the table [m].
    """

    def __init__(
        self,
        arm: YumiArm,
        gripper: ParallelJawGripper,
        T_world_base: FloatArray,
        table_height: float,
    ) -> None:
        self.arm = arm
        self._T_world_base = T_world_base
        self._T_base_world = inverse(T_world_base)
        self._model = arm_model(arm, gripper, T_world_base, table_height)
        self._follower = LineFollower(self._model, arm.home)
        self._collisions = CollisionCheck(self._model)
        self._starts = start_configurations(arm.chain, arm.home, FURTHER_STARTS, seed=0)

    @property
    def description(self) -> RobotDescription:
        """Limits and shape of the arm with its hand."""
        chain = self.arm.chain
        return RobotDescription(
            name=f"ABB IRB 14000, {self.arm.side} arm",
            joint_names=JOINT_NAMES,
            lower=chain.lower,
            upper=chain.upper,
            max_speed=chain.max_speed,
            home=self.arm.home,
            shapes=self._model.shapes,
            mjcf=self._model.mjcf,
        )

    def forward(self, joints: FloatArray) -> FloatArray:
        """T_world_gripper (..., 4, 4) of configurations (..., J)."""
        return np.asarray(self._T_world_base @ self.arm.chain.forward(joints))

    def link_transforms(self, joints: FloatArray) -> dict[str, FloatArray]:
        """T_world_link of every link by name, and of `gripper`."""
        frames = self._T_world_base @ self.arm.chain.link_frames(np.asarray(joints))
        links = {link_name(n): frames[n] for n in range(len(JOINT_NAMES))}
        return {"base": self._T_world_base, **links, "gripper": frames[-1]}

    def reachable(self, T_world_gripper: FloatArray) -> BoolArray:
        """Which poses (N, 4, 4) have a configuration within limits that touches nothing."""
        T = np.asarray(T_world_gripper).reshape(-1, 4, 4)
        result = np.zeros(len(T), dtype=bool)
        open_ = np.arange(len(T))
        for starts in (self._starts[:STARTS], self._starts[STARTS:]):
            if not len(open_):
                break
            joints, solved = solve_many(self.arm.chain, self._T_base_world @ T[open_], starts)
            for row, number in enumerate(open_):
                candidates = joints[row, solved[row]]
                result[number] = any(self._collisions.touching(q) is None for q in candidates)
            open_ = np.flatnonzero(~result)
        return result

    def configurations(self, T_world_gripper: FloatArray, near: FloatArray) -> Iterator[FloatArray]:
        """Configurations that reach a pose, those near a given one first, yielded when asked."""
        T = self._T_base_world @ T_world_gripper[None]
        for starts in (np.concatenate([near[None], self._starts[:STARTS]]), self._starts[STARTS:]):
            joints, solved = solve_many(self.arm.chain, T, starts)
            found = joints[0, solved[0]]
            for index in np.argsort(np.abs(found - near).max(axis=1), kind="stable"):
                # mink has the last word on limits and table clearance
                refined = self._follower.solve(T_world_gripper, found[index])
                if refined is not None:
                    yield refined

    def joint_path(self, start: FloatArray, end: FloatArray) -> JointPath:
        """Straight motion in joint space between configurations (J,).

        Raises:
            UnsafeMotionError: it touches something on the way.
        """
        count = int(np.ceil(np.abs(end - start).max() / CHECK_STEP)) + 1
        shares = np.linspace(0.0, 1.0, max(2, count))
        path = JointPath(start + shares[:, None] * (end - start), shares)
        self._refuse_contacts(path)
        return path

    def line_path(self, T_world_gripper: FloatArray, start: FloatArray) -> JointPath:
        """Straight motion of the gripper from a configuration (J,) to a pose.

        Raises:
            UnreachableError: a point of the line is out of reach.
            UnsafeMotionError: it touches something on the way.
        """
        path = JointPath(*self._follower.follow(self.forward(start), T_world_gripper, start))
        self._refuse_contacts(path)
        return path

    def plan(self, waypoints: Sequence[Waypoint], start: FloatArray) -> list[JointPath]:
        """Paths through all waypoints from a configuration (J,), branches chosen so that all fit.

        Raises:
            UnreachableError: a waypoint, or a point of a line to it, is out of reach.
            UnsafeMotionError: every way there touches something.
        """
        if not waypoints:
            return []
        first, rest = waypoints[0], waypoints[1:]
        failure: RobotError = UnreachableError(f"waypoint {first.name!r} is out of reach")
        for path in self._ways(first, start):
            try:
                if isinstance(path, RobotError):
                    raise path
                return [path, *self.plan(rest, path.joints[-1])]
            except RobotError as error:
                failure = error
        raise failure

    def _ways(self, waypoint: Waypoint, start: FloatArray) -> Iterator[JointPath | RobotError]:
        """The paths to one waypoint worth trying, and why others are none."""
        T = waypoint.T_world_gripper
        if waypoint.path is Path.LINEAR:
            yield _attempt(lambda: self.line_path(T, start), waypoint)
            return
        for end in self.configurations(T, start):
            yield _attempt(lambda end=end: self.joint_path(start, end), waypoint)

    def _refuse_contacts(self, path: JointPath) -> None:
        for joints in path.joints:
            pair = self._collisions.touching(joints)
            if pair is not None:
                raise UnsafeMotionError(f"the motion would bring {pair[0]} to {pair[1]}")


def _attempt(make: object, waypoint: Waypoint) -> JointPath | RobotError:
    try:
        path: JointPath = make()  # type: ignore[operator]
    except RobotError as error:
        return type(error)(f"waypoint {waypoint.name!r}: {error}")
    return path


__all__ = ["ArmPlanner", "JointPath", "frozen"]
