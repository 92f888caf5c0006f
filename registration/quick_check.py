"""A cheap test of many hypotheses: do the model's facing surface points agree with the image?"""

from __future__ import annotations

import numpy as np
from numba import njit

from reach.arrays import FloatArray
from registration.mesh_model import MeshModel
from registration.observation import Observation

POINTS = 400
"""Surface points of the model that are looked up for each hypothesis."""


def seen_through(
    model: MeshModel, seen: Observation, T_camera_object: FloatArray, tolerance: float
) -> FloatArray:
    """Share of the model's facing points that the camera looked through, shape (N,).

    A point behind what the camera saw says nothing: it may be hidden by the part itself.

    Args:
        model: of the part.
        seen: the image's window.
        T_camera_object: hypotheses, shape (N, 4, 4).
        tolerance: a depth this much behind the model's point was seen through it [m].
    """
    k = seen.frame.intrinsics
    step = max(1, len(model.samples) // POINTS)
    result: FloatArray = _seen_through(
        np.ascontiguousarray(model.samples[::step]),
        np.ascontiguousarray(model.normals[::step]),
        T_camera_object,
        seen.depth,
        np.array([k.fx, k.fy, k.cx - seen.corner[0], k.cy - seen.corner[1]]),
        tolerance,
    )
    return result


@njit(cache=True, nogil=True)
def _seen_through(
    samples: FloatArray,
    normals: FloatArray,
    T_camera_object: FloatArray,
    depth: FloatArray,
    camera: FloatArray,
    tolerance: float,
) -> FloatArray:
    height, width = depth.shape
    result = np.ones(len(T_camera_object))
    for h in range(len(T_camera_object)):
        T = T_camera_object[h]
        through, agreed = 0.0, 0.0
        for i in range(len(samples)):
            n, p = normals[i], samples[i]
            x = T[0, 0] * p[0] + T[0, 1] * p[1] + T[0, 2] * p[2] + T[0, 3]
            y = T[1, 0] * p[0] + T[1, 1] * p[1] + T[1, 2] * p[2] + T[1, 3]
            z = T[2, 0] * p[0] + T[2, 1] * p[1] + T[2, 2] * p[2] + T[2, 3]
            facing = -(
                (T[0, 0] * n[0] + T[0, 1] * n[1] + T[0, 2] * n[2]) * x
                + (T[1, 0] * n[0] + T[1, 1] * n[1] + T[1, 2] * n[2]) * y
                + (T[2, 0] * n[0] + T[2, 1] * n[1] + T[2, 2] * n[2]) * z
            )
            if facing <= 0.0 or z <= 1e-3:
                continue
            u = int(np.floor(camera[0] * x / z + camera[2] + 0.5))
            v = int(np.floor(camera[1] * y / z + camera[3] + 0.5))
            if u < 0 or v < 0 or u >= width or v >= height:
                continue
            gap = depth[v, u] - z
            if gap > tolerance:
                through += facing
            elif gap > -tolerance:
                agreed += facing
        if through + agreed > 0.0:
            result[h] = through / (through + agreed)
    return result
