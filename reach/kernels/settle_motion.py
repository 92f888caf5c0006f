"""How a part may move in the hand, and where it is after it has moved.

Wrenches and motions are seen in the gripper's axes with the origin at the part's center of mass;
rotations and torques are scaled by a length, so that a motion's size is a distance.
"""

from __future__ import annotations

import numpy as np

from reach.arrays import FloatArray
from reach.kernels.compiling import compiled


@compiled
def closing_axis(T_gripper_pad: FloatArray) -> tuple[FloatArray, bool]:
    """Axis along which all jaws close, gripper frame; false if they have no common one."""
    axis = T_gripper_pad[0, :3, 2].copy()
    common = len(T_gripper_pad) > 1
    for jaw in range(1, len(T_gripper_pad)):
        along = 0.0
        for i in range(3):
            along += axis[i] * T_gripper_pad[jaw, i, 2]
        if along > -1.0 + 1e-6:
            common = False
    return axis, common


@compiled
def _cross_into(a: FloatArray, b: FloatArray, row: FloatArray) -> float:
    """Write a x b to the first three numbers of a row of zeros; returns its length."""
    squares = 0.0
    for i in range(3):
        j, k = (i + 1) % 3, (i + 2) % 3
        row[i] = a[j] * b[k] - a[k] * b[j]
        squares += row[i] * row[i]
    return float(np.sqrt(squares))


@compiled
def _unit_across(a: FloatArray, b: FloatArray, row: FloatArray) -> None:
    """Write the direction of a x b, or any across a if they are parallel."""
    size = _cross_into(a, b, row)
    if size < 1e-3:
        other = np.zeros(3)
        other[0 if abs(a[0]) < 0.9 else 1] = 1.0
        size = _cross_into(a, other, row)
    for i in range(3):
        row[i] /= size


@compiled
def motions_on_table(up: FloatArray, axis: FloatArray) -> FloatArray:
    """Orthonormal twists of a part that stays on the table, shape (3, 6): two ways to slide, yaw.

    Args:
        up: normal of the table, gripper frame, shape (3,).
        axis: closing axis, gripper frame, shape (3,).
    """
    motions = np.zeros((3, 6))
    _unit_across(up, axis, motions[0])  # any, if the jaws close straight down
    _cross_into(motions[0], up, motions[1])
    for i in range(3):
        motions[2, 3 + i] = up[i]
    return motions


@compiled
def motions_in_air(axis: FloatArray) -> FloatArray:
    """Orthonormal twists of a part that hangs between the jaws, shape (6, 6)."""
    motions = np.zeros((6, 6))
    _unit_across(axis, axis, motions[0])
    _cross_into(axis, motions[0], motions[1])
    for i in range(3):
        motions[2, i] = axis[i]
        motions[3 + i, 3 + i] = 1.0
    return motions


@compiled
def without_axis(motions: FloatArray, axis: FloatArray, common: bool) -> FloatArray:
    """Motions as wrenches see them: the jaws' travel, not friction, balances force along the axis."""
    seen = motions.copy()
    if common:
        for m in range(len(motions)):
            along = 0.0
            for i in range(3):
                along += motions[m, i] * axis[i]
            for i in range(3):
                seen[m, i] -= along * axis[i]
    return seen


@compiled
def moved(
    T_object_gripper: FloatArray,
    com_object: FloatArray,
    twist: FloatArray,
    way: float,
    length: float,
) -> FloatArray:
    """Pose of the gripper in the part after the part has moved.

    Args:
        T_object_gripper: before, shape (4, 4).
        com_object: shape (3,) [m].
        twist: translation of the center of mass and rotation about it times `length`, gripper
            axes, shape (6,).
        way: how far along the twist [m].
        length: torque scale [m].
    """
    T = T_object_gripper
    turn = way / length
    wx, wy, wz = turn * twist[3], turn * twist[4], turn * twist[5]
    angle = np.sqrt(wx * wx + wy * wy + wz * wz)
    s = np.sin(angle) / angle if angle > 1e-12 else 1.0
    c = (1.0 - np.cos(angle)) / (angle * angle) if angle > 1e-6 else 0.5
    # Transpose of the rotation: the gripper turns the other way in the part.
    R = np.empty((3, 3))
    w2 = wx * wx + wy * wy + wz * wz
    R[0, 0], R[1, 1], R[2, 2] = (
        1 + c * (wx * wx - w2),
        1 + c * (wy * wy - w2),
        1 + c * (wz * wz - w2),
    )
    R[0, 1], R[1, 0] = c * wx * wy + s * wz, c * wx * wy - s * wz
    R[0, 2], R[2, 0] = c * wx * wz - s * wy, c * wx * wz + s * wy
    R[1, 2], R[2, 1] = c * wy * wz + s * wx, c * wy * wz - s * wx
    result = np.zeros((4, 4))
    result[3, 3] = 1.0
    com = np.empty(3)
    for i in range(3):
        com[i] = way * twist[i]
        for j in range(3):
            com[i] += T[j, i] * (com_object[j] - T[j, 3])
            result[i, j] = T[i, 0] * R[0, j] + T[i, 1] * R[1, j] + T[i, 2] * R[2, j]
    for i in range(3):
        result[i, 3] = com_object[i]
        for j in range(3):
            result[i, 3] -= result[i, j] * com[j]
    return result


@compiled
def copy_pose(T: FloatArray, to: FloatArray) -> None:
    """Write a pose to another one's place, both of shape (4, 4)."""
    for i in range(4):
        for j in range(4):
            to[i, j] = T[i, j]


@compiled
def motion_between(A: FloatArray, B: FloatArray, com: FloatArray) -> tuple[float, float]:
    """Translation of the center of mass [m] and rotation [rad] of a part seen from the gripper.

    Args:
        A: T_object_gripper before, shape (4, 4).
        B: after.
        com: center of mass, object frame, shape (3,).
    """
    squares, trace = 0.0, 0.0
    for i in range(3):
        difference = 0.0
        for j in range(3):
            difference += B[j, i] * (com[j] - B[j, 3]) - A[j, i] * (com[j] - A[j, 3])
            trace += A[j, i] * B[j, i]
        squares += difference * difference
    return np.sqrt(squares), np.arccos(min(1.0, max(-1.0, 0.5 * (trace - 1.0))))
