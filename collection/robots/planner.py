"""Plans and dry-runs the arm's motions: what was checked is what is executed."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass

import numpy as np

from collection.errors import RobotError, UnreachableError, UnsafeMotionError
from collection.robots.arm_model import arm_model
from collection.robots.description import RobotDescription
from collection.robots.inverse_kinematics import CollisionCheck, LineFollower
from collection.robots.protocol import Path, Waypoint
from collection.robots.reach_search import solve_many, start_configurations
from collection.robots.yumi_arm import JOINT_NAMES, YumiArm, link_name
from reach.arrays import BoolArray, FloatArray
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

    def reversed(self) -> JointPath:
        """The same way back."""
        return JointPath(self.joints[::-1], 1.0 - self.shares[::-1])


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
        self.model = arm_model(arm, gripper, T_world_base, table_height)
        self._follower = LineFollower(self.model, arm.home)
        self._collisions = CollisionCheck(self.model)
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
            shapes=self.model.shapes,
            mjcf=self.model.mjcf,
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
        paths: list[JointPath] = []
        for chain in _chains(waypoints):
            paths += self._plan_chain(chain, paths[-1].joints[-1] if paths else start)
        return paths

    def _plan_chain(self, chain: Sequence[Waypoint], start: FloatArray) -> list[JointPath]:
        """Paths along one chain: to its first pose in joint space, then line by line.

        The branch is chosen at one pose of the chain and followed both ways; if that fails for
        every branch, at another pose: what is hardest to reach decides best.
        """
        if chain[0].path is Path.LINEAR:
            return self._lines(chain, start)
        failure: RobotError | None = None
        for anchor in range(len(chain)):
            reached = False
            for joints in self.configurations(chain[anchor].T_world_gripper, start):
                reached = True
                try:
                    return self._through(chain, anchor, joints, start)
                except RobotError as error:
                    failure = failure or error
            if not reached:
                raise UnreachableError(f"waypoint {chain[anchor].name!r} is out of reach")
        assert failure is not None  # every pose was reached, no way through all was free
        raise failure

    def _through(
        self, chain: Sequence[Waypoint], anchor: int, joints: FloatArray, start: FloatArray
    ) -> list[JointPath]:
        """Paths along a chain that pass a configuration (J,) at one of its poses."""
        back = self._lines(list(reversed(chain[:anchor])), joints)
        first = back[-1].joints[-1] if back else joints
        onward = self._lines(chain[anchor + 1 :], joints)
        with _named(chain[0]):
            to_first = self.joint_path(start, first)
        return [to_first, *(path.reversed() for path in reversed(back)), *onward]

    def _lines(self, waypoints: Sequence[Waypoint], start: FloatArray) -> list[JointPath]:
        paths: list[JointPath] = []
        for waypoint in waypoints:
            with _named(waypoint):
                paths.append(self.line_path(waypoint.T_world_gripper, start))
            start = paths[-1].joints[-1]
        return paths

    def _refuse_contacts(self, path: JointPath) -> None:
        for joints in path.joints:
            pair = self._collisions.touching(joints)
            if pair is not None:
                raise UnsafeMotionError(f"the motion would bring {pair[0]} to {pair[1]}")


def _chains(waypoints: Sequence[Waypoint]) -> list[list[Waypoint]]:
    """Runs of waypoints that one choice of branch must serve: a joint motion and its lines."""
    chains: list[list[Waypoint]] = []
    for waypoint in waypoints:
        if not chains or waypoint.path is Path.JOINT:
            chains.append([])
        chains[-1].append(waypoint)
    return chains


@contextmanager
def _named(waypoint: Waypoint) -> Iterator[None]:
    """Say which waypoint an error is about."""
    try:
        yield
    except RobotError as error:
        raise type(error)(f"waypoint {waypoint.name!r}: {error}") from error
