"""One emulated arm: the motion instructions and functions a RAPID program calls."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation, Slerp

from yumi_emulator.faults import Faults
from yumi_emulator.kinematics import HOME, MAX_SPEED, Chain, NoSolutionError, Vector
from yumi_emulator.runtime import Arguments, RapidError, Run
from yumi_emulator.values import Record, Types

FAR = 9e9
"""What RAPID writes for an axis that is not there."""


LINE_NODES = 9


class ProgramStopError(Exception):
    """The controller stops the program; its ERROR clauses are not asked."""

    def __init__(self, code: int, title: str) -> None:
        super().__init__(title)
        self.code, self.title = code, title


JointPath = Callable[[float], Vector]


class ArmMotion:
    """Kinematics and time of one arm; joints in the controller's order, [rad].

    Args:
        side: `R` or `L`.
        now: reads the controller's time [s].
        faults: what a test makes go wrong.
    """

    def __init__(self, side: str, now: Callable[[], float], faults: Faults) -> None:
        self.chain = Chain(side)
        self.joints = HOME[side].copy()
        self.stopped = False
        self.log: list[str] = []
        self.supervision = 100.0
        self._now, self._faults = now, faults
        self._types = Types({})
        self._branches: dict[tuple[float, ...], Vector] = {}
        self.procedures: dict[str, Callable[[Arguments], Run]] = {
            "moveabsj": self._move_joints,
            "movej": lambda a: self._move(a, linear=False),
            "movel": lambda a: self._move(a, linear=True),
            "motionsup": self._supervise,
            "stopmove": lambda a: self._note("StopMove", stopped=True),
            "clearpath": lambda a: self._note("ClearPath"),
            "startmove": lambda a: self._note("StartMove", stopped=False),
            "confj": lambda a: iter(()),
            "confl": lambda a: iter(()),
        }
        self.functions: dict[str, Callable[[Arguments], Any]] = {
            "crobt": lambda a: self.target_of(self.joints),
            "calcrobt": lambda a: self.target_of(joints_of(a.positional[0])),
            "calcjointt": lambda a: self.joint_target(self.solve(a.positional[0])),
            "offs": _offs,
        }

    def joint_target(self, joints: Vector) -> Record:
        degrees = np.degrees(joints)
        return self._types.typed(
            "jointtarget",
            [[float(q) for q in degrees[:6]], [float(degrees[6]), *[FAR] * 5]],
        )

    def target_of(self, joints: Vector) -> Record:
        """CalcRobT: the pose, and the branch as quadrants and arm angle (not joint 7)."""
        T = self.chain.forward(joints)
        quat = Rotation.from_matrix(T[:3, :3]).as_quat(scalar_first=True)
        conf = [float(np.floor(joints[i] / (np.pi / 2))) for i in (0, 3, 5)] + [0.0]
        angle = float(np.degrees(self.chain.arm_angle(joints)))
        trans, rot = [float(x) for x in T[:3, 3]], [float(q) for q in quat]
        target = self._types.typed("robtarget", [trans, rot, conf, [angle, *[FAR] * 5]])
        self._branches[_branch(target)] = joints.copy()
        return target

    def solve(self, target: Record) -> Vector:
        """CalcJointT. Which branch arm angle and quadrants mean is remembered, not computed."""
        *_, angle = branch = _branch(target)
        seed = self._branches.get(branch, self.joints)
        return self._inverse(pose_of(target), np.radians(angle), seed)

    def _inverse(self, T: Vector, arm_angle: float, seed: Vector) -> Vector:
        try:
            return self.chain.inverse(T, arm_angle, seed)
        except NoSolutionError as error:
            raise RapidError("ERR_OUTSIDE_REACH" if error.outside else "ERR_ROBLIMIT") from error

    def _move_joints(self, arguments: Arguments) -> Run:
        target, speed = arguments.positional[:2]
        goal, start = joints_of(target), self.joints
        duration = max(self._duration(start, goal, speed), _joint_time(start, goal))
        yield from self._follow(lambda share: start + share * (goal - start), duration)

    def _move(self, arguments: Arguments, *, linear: bool) -> Run:
        target, speed = arguments.positional[:2]
        goal, start = self.solve(target), self.joints
        duration = max(self._duration(start, goal, speed), _joint_time(start, goal))
        path = self._line(start, goal) if linear else lambda share: start + share * (goal - start)
        yield from self._follow(path, duration)

    def _line(self, start: Vector, goal: Vector) -> JointPath:
        """Joints along a straight line of the tool, solved at nodes and interpolated."""
        A, B = self.chain.forward(start), self.chain.forward(goal)
        turn = Slerp([0, 1], Rotation.from_matrix([A[:3, :3], B[:3, :3]]))
        angles = np.unwrap([self.chain.arm_angle(start), self.chain.arm_angle(goal)])
        shares, nodes = np.linspace(0.0, 1.0, LINE_NODES), [start]
        for share in shares[1:-1]:
            T = np.eye(4)
            T[:3, :3] = turn(share).as_matrix()
            T[:3, 3] = A[:3, 3] + share * (B[:3, 3] - A[:3, 3])
            angle = float(angles[0] + share * (angles[1] - angles[0]))
            nodes.append(self._inverse(T, angle, nodes[-1]))
        columns = np.array([*nodes, goal]).T
        return lambda share: np.array([np.interp(share, shares, column) for column in columns])

    def _duration(self, start: Vector, goal: Vector, speed: Record) -> float:
        A, B = self.chain.forward(start), self.chain.forward(goal)
        turn = np.degrees(Rotation.from_matrix(A[:3, :3].T @ B[:3, :3]).magnitude())
        way = np.linalg.norm(B[:3, 3] - A[:3, 3])
        return float(max(way / speed.fields["v_tcp"], turn / speed.fields["v_ori"]))

    def _follow(self, path: JointPath, duration: float) -> Run:
        if self.stopped:
            raise AssertionError("a motion after StopMove without StartMove")
        begin, obstacle = self._now(), self._obstacle()
        while True:
            share = min(1.0, (self._now() - begin) / duration) if duration > 0 else 1.0
            if obstacle is not None and share >= obstacle:
                self.joints = path(obstacle)
                raise self._collision()
            self.joints = path(share)
            if share >= 1.0:
                return
            yield

    def _collision(self) -> Exception:
        if self._faults.collision_handled:
            return RapidError("ERR_COLL_STOP")
        return ProgramStopError(50204, "Motion supervision")

    def _obstacle(self) -> float | None:
        obstacle = self._faults.collide_at
        if obstacle is not None:
            self._faults.collisions -= 1
            if self._faults.collisions <= 0:
                self._faults.collide_at = None
        return obstacle

    def _supervise(self, arguments: Arguments) -> Run:
        self.supervision = arguments.optional["tunevalue"]
        yield from ()

    def _note(self, event: str, stopped: bool | None = None) -> Run:
        self.log.append(event)
        self.stopped = self.stopped if stopped is None else stopped
        yield from ()


def joints_of(target: Record) -> Vector:
    robax, extax = target.fields["robax"], target.fields["extax"]
    return np.radians([*robax.numbers(), extax.fields["eax_a"]])


def _branch(target: Record) -> tuple[float, ...]:
    """What tells the branches of one pose apart: quadrants and arm angle [deg]."""
    return (*target.fields["robconf"].numbers(), target.fields["extax"].fields["eax_a"])


def pose_of(target: Record) -> Vector:
    T = np.eye(4)
    T[:3, :3] = Rotation.from_quat(target.fields["rot"].numbers(), scalar_first=True).as_matrix()
    T[:3, 3] = target.fields["trans"].numbers()
    return T


def _joint_time(start: Vector, goal: Vector) -> float:
    return float(np.max(np.abs(goal - start) / MAX_SPEED))


def _offs(arguments: Arguments) -> Record:
    target, *offset = arguments.positional
    for axis, shift in zip("xyz", offset, strict=True):
        target.fields["trans"].fields[axis] += shift
    return target
