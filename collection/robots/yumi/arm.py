"""The real arm: motions planned and dry-run here, executed and solved by the controller."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from collection.errors import RobotError
from collection.robots.planned_arm import PlannedArm
from collection.robots.protocol import Path, Speed, Waypoint
from collection.robots.readings import ArmListener, ArmSample, ArmState, Motion
from collection.robots.stop_latch import STOPPED
from collection.robots.yumi.checks import controller_checks
from collection.robots.yumi.diagnosis import not_ready
from collection.robots.yumi.feedback import Feedback
from collection.robots.yumi.link import ControllerLink
from collection.robots.yumi.messages import Command, Request
from collection.robots.yumi.speeds import motion_time, request_speeds
from collection.robots.yumi_arm import CONTROLLER_ORDER
from reach.arrays import FloatArray
from reach.transforms import as_transform, inverse, quat_wxyz_from_rotation

if TYPE_CHECKING:
    from collection.robots.planner import ArmPlanner
    from collection.station.checkup import Check

HOLDER = "the YuMi arm"
TIME_FACTOR, TIME_MARGIN = 3.0, 10.0
"""A motion may take this many times its estimate, and so much more [s]."""


class YumiRobotArm(PlannedArm):
    """One arm of a YuMi on an IRC5 controller.

    The computer plans and checks every motion and sends where it ends; the controller's own,
    calibrated kinematics executes it. What the controller then reports is read back and compared
    with what was asked.

    Args:
        link: to the controller; the hand shares it.
        make_planner: builds the dry run's model of arm and cell, when it is first needed.
        T_world_base: where the robot stands in the station's world, shape (4, 4).
    """

    same_start = 0.05  # the arm's own accuracy

    def __init__(
        self,
        link: ControllerLink,
        make_planner: Callable[[], ArmPlanner],
        T_world_base: FloatArray,
    ) -> None:
        super().__init__()
        self._link = link
        self._make_planner = make_planner
        self._T_world_base = as_transform(T_world_base, "T_world_base")
        self._feedback = Feedback(link, self._T_world_base, lambda q: self._planner.forward(q))

    @cached_property
    def _planner(self) -> ArmPlanner:
        return self._make_planner()

    @property
    def _start(self) -> FloatArray:
        return self.joints()

    @property
    def name(self) -> str:
        """Of the arm, for logs."""
        return f"ABB IRB 14000 {self._link.task} at {self._link.config.address}"

    def connect(self) -> None:
        """Reach the controller and check that it is ready; moves nothing."""
        self._link.connect(HOLDER)

    def disconnect(self) -> None:
        """Let go of the controller; allowed at any time, more than once."""
        self._link.disconnect(HOLDER)

    def state(self) -> ArmState:
        """What the controller says of itself; an absent controller is a state, too."""
        try:
            state = self._link.state()
        except RobotError as error:
            return ArmState(connected=False, motors_on=False, automatic=False, error=str(error))
        reason = not_ready(state)
        stopped = None if state.running else "the controller's program is stopped"
        if self._link.latch.stands:
            stopped = STOPPED
        return ArmState(
            connected=True,
            motors_on=state.motors == "motoron",
            automatic=state.mode == "AUTO",
            emergency_stop=state.motors.startswith("emergencystop"),
            error=str(reason) if reason else stopped,
        )

    def observe(self) -> FloatArray:
        """T_world_gripper (4, 4) in any mode, also while a person guides the arm."""
        with self._link.session() as services:
            return self._feedback.T_world_gripper(services)

    def checks(self) -> Iterator[Check]:
        """Look at the controller, for `reach doctor`; moves nothing."""
        return controller_checks(self._link, self._feedback, lambda q: self._planner.forward(q))

    def joints(self) -> FloatArray:
        """Measured joints in kinematic order, shape (7,) [rad]."""
        self._link.require(HOLDER)
        return self._feedback.joints()

    def pose(self) -> FloatArray:
        """T_world_gripper as the controller's own kinematics has it, shape (4, 4)."""
        self._link.require(HOLDER)
        return self._feedback.T_world_gripper()

    def move_to_joints(
        self, joints: FloatArray, *, speed: Speed, on_sample: ArmListener | None = None
    ) -> Motion:
        """Move straight in joint space.

        Raises:
            JointLimitError: a target lies outside its limits; nothing moved.
            UnsafeMotionError: the way there touches something; nothing moved.
            StaleReadingError: afterwards the controller does not report these joints.
        """
        self._refuse_outside_limits(joints)
        start = self.joints()
        self._planner.joint_path(start, np.asarray(joints))
        T_start, T_end = self._planner.forward(start), self._planner.forward(joints)
        request = self._request(Command.MOVE_JOINTS, joints, T_end, T_start, start, speed)
        start_ns = self._link.clock.now_ns()
        self._execute(request, self._time(T_start, T_end, start, joints, speed), on_sample)
        reached, T = self._feedback.settle_joints(joints, before=start)
        return Motion(start_ns, self._link.clock.now_ns(), reached, T)

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
        """Move the gripper's frame to a pose; see the protocol.

        Raises:
            UnreachableError: here or on the controller no configuration reaches it.
            CollisionStopError: the arm met resistance; it has stopped and lifted off.
            StaleReadingError: afterwards the controller does not report this pose.
        """
        T_goal = as_transform(T_world_gripper, "T_world_gripper")
        start = self.joints()
        T_start = self._planner.forward(start)
        joints = self._path_to(Waypoint("goal", T_goal, path), start).joints[-1]
        linear = path is Path.LINEAR
        command = Command.MOVE_POSE_LINEAR if linear else Command.MOVE_POSE_JOINT
        supervision = self._link.config.guarded_percent if guarded else 100.0
        request = self._request(
            command, joints, T_goal, T_start, start, speed, 1000 * zone, supervision
        )
        start_ns = self._link.clock.now_ns()
        self._execute(request, self._time(T_start, T_goal, start, joints, speed), on_sample)
        reached, T = self._feedback.settle_pose(T_goal, stops=zone <= 0, before=start)
        return Motion(start_ns, self._link.clock.now_ns(), reached, T)

    def stop(self) -> None:
        """Stop any motion now, of both arms, until `release_stop`.

        Raises:
            ConnectionLostError: the stop did not reach the controller.
        """
        self._link.stop()

    def release_stop(self) -> None:
        """Take `stop` back, on the word of a person; the program rests until `clear_error`."""
        self._link.release_stop()

    def halt(self) -> None:
        """Stop any motion now, of both arms; `clear_error` makes the arm follow again.

        Raises:
            ConnectionLostError: it did not reach the controller.
        """
        self._link.halt()

    def clear_error(self) -> None:
        """Acknowledge a halt or error: motors on, program from its start; moves nothing.

        Raises:
            StoppedError: the operator's stop stands.
            RobotError: if only a person can clear it (emergency stop, manual mode).
        """
        self._link.require(HOLDER)
        self._link.recover()

    def _execute(self, request: Request, estimate: float, on_sample: ArmListener | None) -> None:
        program = self._link.require(HOLDER)
        timeout = TIME_FACTOR * estimate + TIME_MARGIN
        report = None if on_sample is None else lambda: on_sample(self._sample())
        program.serve(request, timeout=timeout, meanwhile=report)

    def _sample(self) -> ArmSample:
        joints = self._feedback.joints()
        return ArmSample(self._link.clock.now_ns(), joints, self._planner.forward(joints))

    def _request(
        self,
        command: Command,
        joints: FloatArray,
        T_world_goal: FloatArray,
        T_start: FloatArray,
        start: FloatArray,
        speed: Speed,
        zone_mm: float = 0.0,
        supervision: float = 100.0,
    ) -> Request:
        T_base_goal = inverse(self._T_world_base) @ T_world_goal
        speed_mm, turn_deg = request_speeds(
            T_start, T_world_goal, joints - start, self.description.max_speed, speed
        )
        return Request(
            command,
            joints_deg=tuple(np.degrees(joints[list(CONTROLLER_ORDER)])),
            position_mm=tuple(1000 * T_base_goal[:3, 3]),
            quat_wxyz=tuple(quat_wxyz_from_rotation(T_base_goal[:3, :3])),
            speed_mm=speed_mm,
            turn_deg=turn_deg,
            zone_mm=zone_mm,
            supervision_percent=supervision,
        )

    def _time(
        self,
        T_start: FloatArray,
        T_end: FloatArray,
        start: FloatArray,
        end: FloatArray,
        speed: Speed,
    ) -> float:
        return max(motion_time(T_start, T_end, end - start, self.description.max_speed, speed))
