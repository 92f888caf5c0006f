"""How far is a pose from standing on the table in one of the stable poses?"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from reach.arrays import FloatArray
from reach.stable_poses import StablePose
from reach.symmetry import Symmetry


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
