"""How far two grasps are apart, where a jaw has no name.

Turning a parallel-jaw gripper by 180 degrees about its approach exchanges its jaws and changes
nothing else, so the distance is the smaller one over both ways.
"""

from __future__ import annotations

import numpy as np

from reach.arrays import FloatArray

ROTATION_LENGTH = 0.02
"""Length that turns an angle into a distance: a pad's width [m/rad]."""
_HALF_TURN = np.diag([-1.0, -1.0, 1.0])


def grasp_distance(T_a: FloatArray, T_b: FloatArray, T_gripper_center: FloatArray) -> FloatArray:
    """Distance [m] of grasps in SE(3), invariant to exchanging the jaws.

    The root of the squared distance of the pads' centers plus the squared angle times
    ROTATION_LENGTH.

    Args:
        T_a: poses of the gripper, shape (..., 4, 4).
        T_b: poses of the gripper in the same frame, shape (..., 4, 4), broadcast against T_a.
        T_gripper_center: point between the pads, shape (4, 4), gripper frame.
    """
    center_a, center_b = (T @ T_gripper_center for T in (T_a, T_b))
    shift = np.linalg.norm(center_a[..., :3, 3] - center_b[..., :3, 3], axis=-1)
    R_a, R_b = center_a[..., :3, :3], center_b[..., :3, :3]
    angle = np.minimum(_angle(R_a, R_b), _angle(R_a @ _HALF_TURN, R_b))
    distance: FloatArray = np.hypot(shift, ROTATION_LENGTH * angle)
    return distance


def _angle(R_a: FloatArray, R_b: FloatArray) -> FloatArray:
    # |R_a - R_b| = 2 sqrt(2) sin(angle / 2) keeps its digits near zero.
    chord = np.linalg.norm(R_a - R_b, axis=(-2, -1)) / (2 * np.sqrt(2))
    angle: FloatArray = 2 * np.arcsin(np.clip(chord, 0, 1))
    return angle
