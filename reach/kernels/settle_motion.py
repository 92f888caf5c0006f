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
def _unit(v: FloatArray) -> FloatArray:
    unit: FloatArray = v / np.sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2])
    return unit


@compiled
def _cross(a: FloatArray, b: FloatArray) -> FloatArray:
    c = np.empty(3)
    c[0] = a[1] * b[2] - a[2] * b[1]
    c[1] = a[2] * b[0] - a[0] * b[2]
    c[2] = a[0] * b[1] - a[1] * b[0]
    return c


@compiled
def motions_on_table(up: FloatArray, axis: FloatArray) -> FloatArray:
    """Orthonormal twists of a part that stays on the table, shape (3, 6): two ways to slide, yaw.

    Args:
        up: normal of the table, gripper frame, shape (3,).
        axis: closing axis, gripper frame, shape (3,).
    """
    across = _cross(up, axis)
    if across[0] ** 2 + across[1] ** 2 + across[2] ** 2 < 1e-6:  # closing straight down
        other = np.zeros(3)
        other[0 if abs(up[0]) < 0.9 else 1] = 1.0
        across = _cross(up, other)
    across = _unit(across)
    motions = np.zeros((3, 6))
    motions[0, :3] = across
    motions[1, :3] = _cross(across, up)
    motions[2, 3:] = up
    return motions


@compiled
def motions_in_air(axis: FloatArray) -> FloatArray:
    """Orthonormal twists of a part that hangs between the jaws, shape (6, 6)."""
    other = np.zeros(3)
    other[0 if abs(axis[0]) < 0.9 else 1] = 1.0
    first = _unit(_cross(axis, other))
    motions = np.zeros((6, 6))
    motions[0, :3], motions[1, :3], motions[2, :3] = first, _cross(axis, first), axis
    for i in range(3):
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
    T_object_gripper: FloatArray, com_object: FloatArray, twist: FloatArray, length: float
) -> FloatArray:
    """Pose of the gripper in the part after the part has moved.

    Args:
        T_object_gripper: before, shape (4, 4).
        com_object: shape (3,) [m].
        twist: translation of the center of mass [m] and rotation about it times `length` [m],
            gripper axes, shape (6,).
        length: torque scale [m].
    """
    T = T_object_gripper
    wx, wy, wz = twist[3] / length, twist[4] / length, twist[5] / length
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
        com[i] = twist[i]
        for j in range(3):
            com[i] += T[j, i] * (com_object[j] - T[j, 3])
            result[i, j] = T[i, 0] * R[0, j] + T[i, 1] * R[1, j] + T[i, 2] * R[2, j]
    for i in range(3):
        result[i, 3] = com_object[i]
        for j in range(3):
            result[i, 3] -= result[i, j] * com[j]
    return result


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
