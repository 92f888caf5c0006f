"""Joint paths of the arm: mink follows lines in space, within limits and clear of the table."""

from __future__ import annotations

import mink
import mujoco
import numpy as np

from collection.errors import UnreachableError
from collection.robots.arm_model import ArmModel
from reach.arrays import FloatArray
from reach.transforms import exp, inverse, log

POSITION_TOLERANCE, ROTATION_TOLERANCE = 1e-4, 1e-3
ITERATIONS = 30
LINE_STEP, LINE_TURN = 0.010, 0.10
"""Longest piece of a line solved at once [m], [rad]."""
LARGEST_JUMP = 0.35
"""A joint that moves further within one piece has changed the arm's branch [rad]."""
TABLE_CLEARANCE, TABLE_HORIZON = 0.005, 0.05
FINGERTIP_TOUCH = 2e-3
"""A hand planned this far into the table only touches it: the guarded approach ends there [m]."""


class LineFollower:
    """Solves configurations near a known one, for poses near a known one.

    Args:
        arm: the arm's model.
        posture: configuration that the redundant axis is drawn to, shape (J,) [rad].
    """

    def __init__(self, arm: ArmModel, posture: FloatArray) -> None:
        self._configuration = mink.Configuration(arm.model)
        self._task = mink.FrameTask(
            "gripper", "body", position_cost=1.0, orientation_cost=1.0, lm_damping=1e-3
        )
        self._posture = mink.PostureTask(arm.model, cost=1e-3)
        self._posture.set_target(posture)
        self._limits = [
            mink.ConfigurationLimit(arm.model),
            mink.CollisionAvoidanceLimit(
                arm.model,
                geom_pairs=[(list(arm.link_geoms), ["table"])],
                minimum_distance_from_collisions=TABLE_CLEARANCE,
                collision_detection_distance=TABLE_HORIZON,
            ),
        ]

    def solve(self, T_world_gripper: FloatArray, joints: FloatArray) -> FloatArray | None:
        """Configuration (J,) that reaches a pose, found from a near one; None if there is none."""
        configuration, task = self._configuration, self._task
        configuration.update(np.array(joints))
        task.set_target(mink.SE3.from_matrix(np.array(T_world_gripper)))
        for _ in range(ITERATIONS):
            error = task.compute_error(configuration)
            near = np.linalg.norm(error[:3]) < POSITION_TOLERANCE
            if near and np.linalg.norm(error[3:]) < ROTATION_TOLERANCE:
                return np.array(configuration.q)
            try:
                velocity = mink.solve_ik(
                    configuration, [task, self._posture], 1.0, "daqp", limits=self._limits
                )
            except mink.MinkError:
                return None
            configuration.integrate_inplace(velocity, 1.0)
        return None

    def follow(
        self, T_start: FloatArray, T_end: FloatArray, joints: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """Follow a line from a pose to another.

        Args:
            T_start: T_world_gripper at the start, shape (4, 4).
            T_end: at the end.
            joints: configuration at the start, shape (J,) [rad].

        Returns:
            Configurations along the line (K, J), the first the given one, and the share of the
            line at each (K,).

        Raises:
            UnreachableError: a point of the line is out of reach, or needs another branch.
        """
        twist = log(inverse(T_start) @ T_end)
        length = max(
            float(np.linalg.norm(T_end[:3, 3] - T_start[:3, 3])) / LINE_STEP,
            float(np.linalg.norm(twist[:3])) / LINE_TURN,
        )
        shares = np.linspace(0.0, 1.0, max(1, int(np.ceil(length))) + 1)
        path = [np.array(joints)]
        points = line_points(T_start, T_end, twist, shares[1:])
        for share, T in zip(shares[1:], points, strict=True):
            solution = self.solve(T, path[-1])
            if solution is None or np.abs(solution - path[-1]).max() > LARGEST_JUMP:
                raise UnreachableError(
                    f"the arm cannot follow the line to {_where(T_end)}: "
                    f"{100 * share:.0f} % of it is out of reach"
                )
            path.append(solution)
        return np.array(path), shares


def line_points(
    T_start: FloatArray, T_end: FloatArray, twist: FloatArray, shares: FloatArray
) -> FloatArray:
    """Poses (N, 4, 4) at shares (N,) of a line: the origin moves straight, the rotation evenly."""
    turn = np.concatenate([twist[:3], np.zeros(3)])
    T = T_start @ exp(shares[:, None] * turn)
    T[:, :3, 3] = (1.0 - shares[:, None]) * T_start[:3, 3] + shares[:, None] * T_end[:3, 3]
    return T


class CollisionCheck:
    """Whether configurations touch the table or the robot itself."""

    def __init__(self, arm: ArmModel) -> None:
        self._model = arm.model
        self._data = mujoco.MjData(arm.model)
        self._table = arm.model.geom("table").id
        self._hand = {arm.model.geom(name).id for name in arm.hand_geoms}

    def touching(self, joints: FloatArray) -> tuple[str, str] | None:
        """The two geoms that touch in a configuration (J,), or None."""
        self._data.qpos[:] = joints
        mujoco.mj_kinematics(self._model, self._data)
        mujoco.mj_collision(self._model, self._data)
        for contact in self._data.contact[: self._data.ncon]:
            pair = (contact.geom1, contact.geom2)
            fingertip_on_table = self._table in pair and not self._hand.isdisjoint(pair)
            if not fingertip_on_table or contact.dist < -FINGERTIP_TOUCH:
                return self._model.geom(pair[0]).name, self._model.geom(pair[1]).name
        return None


def _where(T: FloatArray) -> str:
    x, y, z = T[:3, 3]
    return f"({x:.3f}, {y:.3f}, {z:.3f}) m"
