"""What the controller reports of the arm, read back after each motion and compared.

Two paths lead from the controller to the gripper's pose: its joints through our kinematics, and
its own Cartesian reading. A joint that is not updated (joint 7 is an external axis to the
controller) makes them disagree.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from collection.clock import NANOSECONDS
from collection.errors import StaleReadingError
from collection.robots.yumi.link import ControllerLink
from collection.robots.yumi.web_services import WebServices
from collection.robots.yumi_arm import CONTROLLER_ORDER, JOINT_NAMES
from reach.arrays import FloatArray
from reach.transforms import inverse, rotation_angle

JOINT_TOLERANCE = 0.002
"""Of a joint after a motion to joints [rad]."""
POSITION_TOLERANCE, ROTATION_TOLERANCE = 0.0005, 0.005
"""Of the pose after a motion to a pose that stops there [m], [rad]."""
REST = 1e-4
"""Joints that differ by less between two looks rest [rad]."""
MODEL_POSITION, MODEL_ROTATION = 0.005, 0.02
"""How far our kinematics may lie from the controller's [m], [rad]; at home it is 0.0016 m."""


class Feedback:
    """Readings of one arm.

    Args:
        link: to the controller.
        T_world_base: where the robot stands, shape (4, 4).
        forward: our kinematics, joints (7,) to T_world_gripper (4, 4).
    """

    def __init__(
        self,
        link: ControllerLink,
        T_world_base: FloatArray,
        forward: Callable[[FloatArray], FloatArray],
    ) -> None:
        self._link, self._T_world_base, self._forward = link, T_world_base, forward

    def joints(self, services: WebServices | None = None) -> FloatArray:
        """Joints in kinematic order, shape (7,) [rad]; over a passing session if one is given."""
        services = services or self._link.services
        reported = np.radians(services.joints_deg(self._link.unit))
        joints = np.empty(len(CONTROLLER_ORDER))
        joints[list(CONTROLLER_ORDER)] = reported
        return joints

    def T_world_gripper(self, services: WebServices | None = None) -> FloatArray:
        """The controller's own Cartesian reading, shape (4, 4)."""
        services = services or self._link.services
        pose: FloatArray = self._T_world_base @ services.T_base_tool(self._link.unit)
        return pose

    def settle_joints(
        self, goal: FloatArray, *, before: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """Read until the joints are the commanded ones.

        Args:
            goal: commanded joints, shape (7,) [rad].
            before: as read before the motion.

        Returns:
            Joints (7,) and T_world_gripper (4, 4), as read.

        Raises:
            StaleReadingError: they stay different.
        """

        def complaint(joints: FloatArray, T: FloatArray) -> str | None:
            worst = int(np.argmax(np.abs(joints - goal)))
            off = abs(float(joints[worst] - goal[worst]))
            if off <= JOINT_TOLERANCE:
                return None
            return f"{_said(worst, joints, before)} instead of {goal[worst]:.4f} rad"

        return self._settle(complaint)

    def settle_pose(
        self, T_goal: FloatArray, *, stops: bool, before: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """Read until the pose is the commanded one, and the joints agree with it and rest.

        Args:
            T_goal: commanded T_world_gripper, shape (4, 4).
            stops: whether the motion stops there; through a fly-by zone it need not be there.
            before: joints as read before the motion, shape (7,) [rad].

        Returns:
            Joints (7,) and T_world_gripper (4, 4), as read.

        Raises:
            StaleReadingError: they stay different.
        """
        last = before

        def complaint(joints: FloatArray, T: FloatArray) -> str | None:
            nonlocal last
            moved, last = float(np.max(np.abs(joints - last))), joints
            if stops and not _near(T, T_goal, POSITION_TOLERANCE, ROTATION_TOLERANCE):
                return f"the gripper {_apart(T, T_goal)} from where it was sent"
            if not _near(self._forward(joints), T, MODEL_POSITION, MODEL_ROTATION):
                stale = int(np.argmin(np.abs(joints - before)))
                return (
                    f"joints that put the gripper {_apart(self._forward(joints), T)} from the"
                    f" pose it reports; {_said(stale, joints, before)}"
                )
            if stops and moved > REST:
                return f"joints that still turn, by {moved:.4f} rad since the last look"
            return None

        return self._settle(complaint)

    def _settle(
        self, complaint: Callable[[FloatArray, FloatArray], str | None]
    ) -> tuple[FloatArray, FloatArray]:
        clock, config = self._link.clock, self._link.config
        deadline = clock.now_ns() + round(config.settle_time * NANOSECONDS)
        while True:
            joints, T = self.joints(), self.T_world_gripper()
            wrong = complaint(joints, T)
            if wrong is None:
                return joints, T
            if clock.now_ns() >= deadline:
                raise StaleReadingError(
                    f"{config.settle_time:.1f} s after the motion the controller reports {wrong}"
                )
            clock.sleep(config.poll_interval)


def _said(joint: int, joints: FloatArray, before: FloatArray) -> str:
    unmoved = " (unchanged since before the motion)" if joints[joint] == before[joint] else ""
    return f"{JOINT_NAMES[joint]} at {joints[joint]:.4f} rad{unmoved}"


def _near(T: FloatArray, T_other: FloatArray, position: float, rotation: float) -> bool:
    way = float(np.linalg.norm(T[:3, 3] - T_other[:3, 3]))
    return way <= position and rotation_angle(T[:3, :3].T @ T_other[:3, :3]) <= rotation


def _apart(T: FloatArray, T_other: FloatArray) -> str:
    delta = inverse(T) @ T_other
    way = 1000 * float(np.linalg.norm(delta[:3, 3]))
    return f"{way:.1f} mm and {np.degrees(rotation_angle(delta[:3, :3])):.2f} deg"
