"""How far is a pose from standing on the table in one of the stable poses?"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from reach.arrays import FloatArray
from reach.stable_poses import StablePose
from reach.symmetry import Symmetry
from reach.transforms import rotation_about


def nearest_stable_pose(
    T_camera_object: FloatArray,
    up_camera: FloatArray,
    poses: Sequence[StablePose],
    sym: Symmetry,
) -> tuple[int | None, float]:
    """Index of the stable pose that the part leans against least, and by how much [rad].

    Args:
        T_camera_object: shape (4, 4).
        up_camera: the table's normal, shape (3,), camera frame.
        poses: stable poses of the part.
        sym: of the part: symmetric copies of a stable pose are the same pose.
    """
    up_object = T_camera_object[:3, :3].T @ up_camera
    tilts = [sym.equivalent_directions(pose.T_world_object[2, :3], up_object) for pose in poses]
    if not tilts:
        return None, float("nan")
    best = int(np.argmin(tilts))
    return poses[best].index, float(tilts[best])


def stood_up(
    T_camera_object: FloatArray,
    up_camera: FloatArray,
    table_offset: float,
    pose: StablePose,
    sym: Symmetry,
    hull_vertices: FloatArray,
) -> FloatArray:
    """The pose (4, 4) righted into a stable pose by the smallest turn, and set on the table.

    Args:
        T_camera_object: shape (4, 4).
        up_camera: the table's normal, shape (3,), camera frame.
        table_offset: up_camera @ p of points p on the table [m].
        pose: the stable pose.
        sym: of the part.
        hull_vertices: corners of the part's convex hull, shape (H, 3), object frame [m].
    """
    up_object = T_camera_object[:3, :3].T @ up_camera
    right = nearest_copy(pose.T_world_object[2, :3], up_object, sym)
    T = np.array(T_camera_object)
    T[:3, :3] = T_camera_object[:3, :3] @ _turn_between(right, up_object)
    T[:3, 3] += (T_camera_object[:3, :3] - T[:3, :3]) @ sym.center
    lowest = float((hull_vertices @ (T[:3, :3].T @ up_camera)).min() + up_camera @ T[:3, 3])
    T[:3, 3] += (table_offset - lowest) * up_camera
    return T


def nearest_copy(direction: FloatArray, target: FloatArray, sym: Symmetry) -> FloatArray:
    """The symmetric copy of a direction that is nearest to a target, both (3,), object frame."""
    if sym.sphere:
        return target
    copies = sym.rotations @ direction
    if sym.axis is not None:
        along = copies @ sym.axis
        aside = target - (target @ sym.axis) * sym.axis
        length = float(np.linalg.norm(aside))
        if length > 1e-9:
            swing = np.sqrt(np.maximum(0.0, 1.0 - along**2))
            copies = along[:, None] * sym.axis + swing[:, None] * aside / length
    nearest: FloatArray = copies[int(np.argmax(copies @ target))]
    return nearest


def _turn_between(a: FloatArray, b: FloatArray) -> FloatArray:
    """Smallest rotation (3, 3) that takes unit vector a (3,) to b (3,), less than a half turn."""
    cross = np.cross(a, b)
    sine = float(np.linalg.norm(cross))
    if sine < 1e-12:
        return np.eye(3)
    return rotation_about(cross, float(np.arctan2(sine, a @ b)))
