"""The simulated arm: plans like a real one, moves a hand through simulated physics."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from collection.cell.faults import FaultKind, scripted
from collection.errors import (
    CollisionStopError,
    EmergencyStopError,
    RobotError,
)
from collection.robots.planned_arm import PlannedArm
from collection.robots.planner import ArmPlanner, JointPath
from collection.robots.protocol import Path, Speed, Waypoint
from collection.robots.readings import ArmListener, ArmSample, ArmState, Motion
from collection.robots.simulated_controller import SimulatedController
from reach.arrays import FloatArray, frozen
from reach.transforms import inverse, rotation_angle

CONTROL_PERIOD = 4e-3
"""Between two targets of the wrist while physics is stepped [s]."""
STRIDE = 10
"""Control periods that a motion far from everything takes at once."""
PEAK_OVER_MEAN = 1.5
"""Of the cubic speed profile."""


@dataclass(frozen=True, slots=True, eq=False)
class _Trajectory:
    """Joints (K, J) and T_world_gripper (K, 4, 4) at every control period of a motion."""

    joints: FloatArray
    T_world_gripper: FloatArray


class SimulatedArm(PlannedArm):
    """One simulated YuMi arm.

    Args:
        planner: its kinematics.
        controller: shared with the hand.
    """

    same_start = 1e-9

    def __init__(self, planner: ArmPlanner, controller: SimulatedController) -> None:
        super().__init__()
        self._own_planner = planner
        self._controller = controller
        self._simulation = controller.simulation
        self._joints: FloatArray = np.array(planner.arm.home)

    @property
    def _planner(self) -> ArmPlanner:
        return self._own_planner

    @property
    def _start(self) -> FloatArray:
        return self._joints

    @property
    def name(self) -> str:
        """Of the arm, for logs."""
        return f"simulated YuMi, {self._planner.arm.side} arm"

    def connect(self) -> None:
        """Reach the simulated controller."""
        self._controller.connect("arm")
        self._simulation.joints = frozen(self._joints)
        self._simulation.move_hand(self._planner.forward(self._joints))

    def disconnect(self) -> None:
        """Let go of the controller."""
        self._controller.disconnect("arm")

    def state(self) -> ArmState:
        """What the controller says of itself."""
        return self._controller.state("arm")

    def joints(self) -> FloatArray:
        """Measured joints, shape (7,) [rad]."""
        self._controller.require("arm")
        return self._measured_joints()

    def pose(self) -> FloatArray:
        """Measured T_world_gripper, shape (4, 4)."""
        return frozen(self._planner.forward(self.joints()))

    def move_to_joints(
        self, joints: FloatArray, *, speed: Speed, on_sample: ArmListener | None = None
    ) -> Motion:
        """Move straight in joint space.

        Raises:
            JointLimitError: a target lies outside its limits; nothing moved.
            UnsafeMotionError: the way there touches something; nothing moved.
        """
        self._controller.require("arm")
        self._refuse_outside_limits(joints)
        path = self._planner.joint_path(self._joints, np.asarray(joints))
        return self._execute(path, speed, guarded=False, on_sample=on_sample)

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
        """Move the gripper's frame to a pose; a motion that was checked is executed as checked.

        The simulated arm stops at every pose, whatever the zone.

        Raises:
            UnreachableError: no configuration reaches it; nothing moved.
            CollisionStopError: stopped by a contact.
        """
        self._controller.require("arm")
        joint_path = self._path_to(Waypoint("target", T_world_gripper, path), self._joints)
        return self._execute(joint_path, speed, guarded=guarded, on_sample=on_sample)

    def stop(self) -> None:
        """Stop any motion now, until `release_stop`."""
        self._controller.stop()

    def release_stop(self) -> None:
        """Take `stop` back, on the word of a person."""
        self._controller.release_stop()

    def halt(self) -> None:
        """End any motion now, until `clear_error`."""
        self._controller.halt()

    def clear_error(self) -> None:
        """Acknowledge a halt or error.

        Raises:
            EmergencyStopError: the emergency stop is still pressed.
            StoppedError: the operator's stop stands.
        """
        self._controller.clear()

    def _execute(
        self, path: JointPath, speed: Speed, *, guarded: bool, on_sample: ArmListener | None
    ) -> Motion:
        simulation, clock = self._simulation, self._simulation.clock
        start_ns = clock.now_ns()
        clock.sleep(simulation.settings.latency)
        if not simulation.carrying:
            simulation.new_motion_error()
        self._slip_if_scripted(path)
        trajectory = self._trajectory(path, self._duration(path, speed))
        step, next_sample_ns = 0, 0
        while step < len(trajectory.joints) - 1:
            self._controller.heed_stop()
            step = self._advance(trajectory, step)
            self._watch(path, step / (len(trajectory.joints) - 1), guarded=guarded)
            if on_sample is not None and clock.now_ns() >= next_sample_ns:
                on_sample(self._sample())
                next_sample_ns = clock.now_ns() + round(simulation.settings.sample_period * 1e9)
        sample = self._sample()
        return Motion(start_ns, clock.now_ns(), sample.joints, sample.T_world_gripper)

    def _advance(self, trajectory: _Trajectory, step: int) -> int:
        """Go on to a later step of a motion; a long one where no physics needs small ones."""
        simulation = self._simulation
        last = len(trajectory.joints) - 1
        stride = 1 if simulation.dynamic else STRIDE
        following = min(last, step + stride)
        self._joints = trajectory.joints[following]
        simulation.joints = self._joints
        simulation.move_hand(trajectory.T_world_gripper[following])
        simulation.clock.sleep((following - step) * CONTROL_PERIOD)
        return following

    def _trajectory(self, path: JointPath, duration: float) -> _Trajectory:
        """The motion at every control period, starting and ending at rest."""
        count = max(2, int(np.ceil(duration / CONTROL_PERIOD)) + 1)
        share = np.linspace(0.0, 1.0, count)
        eased = share * share * (3.0 - 2.0 * share)
        columns = [np.interp(eased, path.shares, column) for column in path.joints.T]
        joints = np.column_stack(columns)
        return _Trajectory(frozen(joints), frozen(self._planner.forward(joints)))

    def _watch(self, path: JointPath, share: float, *, guarded: bool) -> None:
        """Stop the motion where something stops it."""
        simulation = self._simulation
        if share >= 0.5 and self._lifts(path):
            if simulation.fault_due(FaultKind.CONNECTION_LOST):
                raise self._controller.fail(_as_robot_error(FaultKind.CONNECTION_LOST))
            if simulation.fault_due(FaultKind.EMERGENCY_STOP):
                raise self._controller.fail(
                    EmergencyStopError("the emergency stop was pressed during the lift (scripted)")
                )
        if guarded and share >= 0.5 and simulation.fault_due(FaultKind.COLLISION_STOP):
            raise self._controller.fail(_as_robot_error(FaultKind.COLLISION_STOP))
        settings = simulation.settings
        limit = settings.guarded_force if guarded else settings.hard_force
        force = simulation.wrist_force
        if force > limit:
            raise self._controller.fail(
                CollisionStopError(f"the arm met {force:.1f} N, more than {limit:.1f} N")
            )

    def _slip_if_scripted(self, path: JointPath) -> None:
        if self._lifts(path) and self._simulation.fault_due(FaultKind.SLIP):
            self._simulation.make_pads_slip()

    def _lifts(self, path: JointPath) -> bool:
        rise = (
            self._planner.forward(path.joints[-1])[2, 3]
            - self._planner.forward(path.joints[0])[2, 3]
        )
        return self._simulation.carrying and bool(rise > 0.01)

    def _duration(self, path: JointPath, speed: Speed) -> float:
        T_start, T_end = (
            self._planner.forward(path.joints[0]),
            self._planner.forward(path.joints[-1]),
        )
        length = float(np.linalg.norm(T_end[:3, 3] - T_start[:3, 3]))
        angle = rotation_angle((inverse(T_start) @ T_end)[:3, :3])
        travels = np.abs(np.diff(path.joints, axis=0)).sum(axis=0)
        joints = float((travels / (speed.joint * self._planner.arm.chain.max_speed)).max())
        slowest = max(length / speed.linear, angle / speed.angular, joints)
        return max(CONTROL_PERIOD, PEAK_OVER_MEAN * slowest)

    def _measured_joints(self) -> FloatArray:
        noise = self._simulation.noise.normal(0.0, self._simulation.settings.joint_noise, 7)
        return frozen(self._joints + noise)

    def _sample(self) -> ArmSample:
        joints = self._measured_joints()
        T = frozen(self._planner.forward(joints))
        return ArmSample(self._simulation.clock.now_ns(), joints, T)


def _as_robot_error(kind: FaultKind) -> RobotError:
    error = scripted(kind)
    assert isinstance(error, RobotError)
    return error
