"""What the camera would see of hypotheses: depths of the rays that can meet them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numba import njit
from numpy.typing import NDArray

from reach.arrays import FloatArray, IntArray
from reach.transforms import inverse
from registration.mesh_model import MeshModel
from registration.observation import NO_RETURN, TABLE, Observation

NEAR_TABLE = 4e-3
"""A predicted depth this close to the table's was cut away with it [m]."""


@dataclass(frozen=True, slots=True, eq=False)
class Rendered:
    """What the camera would see of N hypotheses, each in its own rectangle of pixels.

    Args:
        boxes: rectangles (v0, v1, u0, u1) of strided window pixels, shape (N, 4).
        depth: of all rectangles' pixels, one hypothesis after the other, inf for a miss, (P,).
        slope: |normal . ray| at the hits, for rays of unit depth, shape (P,).
    """

    boxes: IntArray
    depth: NDArray[np.float32]
    slope: FloatArray


def render(
    model: MeshModel,
    seen: Observation,
    T_camera_object: FloatArray,
    rays: FloatArray,
    stride: int,
) -> Rendered:
    """Cast the rays (h, w, 3) of every stride-th pixel at each hypothesis (N, 4, 4)."""
    boxes = _footprints(model, seen, T_camera_object, stride)
    return Rendered(boxes, *_cast(model, rays, T_camera_object, boxes))


def visible_centroids(
    seen: Observation, rendered: Rendered, stride: int, default: FloatArray
) -> FloatArray:
    """Mean of the points seen of each hypothesis, shape (N, 3), camera frame [m].

    Where the image has no return (a shadow) the part's points would not have been observed
    either, nor so low above the table that they were cut away with it; such pixels are left out.

    Args:
        seen: the image's window.
        rendered: hypotheses, at a stride.
        stride: of the rendered pixels.
        default: what to return for a hypothesis out of the image, shape (N, 3).
    """
    labels = np.ascontiguousarray(seen.labels[::stride, ::stride])
    depth = np.ascontiguousarray(seen.depth[::stride, ::stride])
    result: FloatArray = _visible_centroids(
        rendered.boxes, rendered.depth, seen.rays(stride), labels, depth, default
    )
    return result


def _footprints(
    model: MeshModel, seen: Observation, T_camera_object: FloatArray, stride: int
) -> IntArray:
    """Rectangles (N, 4) of strided window pixels, (v0, v1, u0, u1), that the hypotheses cover."""
    k = seen.frame.intrinsics
    hull = model.hull_vertices
    points = (
        T_camera_object[:, None, :3, 0] * hull[None, :, 0, None]
        + T_camera_object[:, None, :3, 1] * hull[None, :, 1, None]
        + T_camera_object[:, None, :3, 2] * hull[None, :, 2, None]
        + T_camera_object[:, None, :3, 3]
    )
    z = np.maximum(points[..., 2], 1e-3)
    u = (points[..., 0] / z * k.fx + k.cx - seen.corner[0]) / stride
    v = (points[..., 1] / z * k.fy + k.cy - seen.corner[1]) / stride
    rows, columns = -(-seen.depth.shape[0] // stride), -(-seen.depth.shape[1] // stride)
    box = np.stack(
        [
            np.clip(np.floor(v.min(axis=1)), 0, rows),
            np.clip(np.ceil(v.max(axis=1)) + 1, 0, rows),
            np.clip(np.floor(u.min(axis=1)), 0, columns),
            np.clip(np.ceil(u.max(axis=1)) + 1, 0, columns),
        ],
        axis=1,
    )
    return box.astype(np.int64)


def _cast(
    model: MeshModel, rays: FloatArray, T_camera_object: FloatArray, boxes: IntArray
) -> tuple[NDArray[np.float32], FloatArray]:
    """Depths (P,) and |normal . ray| (P,) of all hypotheses' rectangles, one after the other."""
    count = int(((boxes[:, 1] - boxes[:, 0]) * (boxes[:, 3] - boxes[:, 2])).sum())
    cast = np.empty((count, 6), np.float32)
    _fill_rays(cast, rays, np.ascontiguousarray(inverse(T_camera_object)), boxes)
    depth, normals = model.raycasting.cast(cast)
    slope = np.abs((normals * cast[:, 3:]).sum(axis=1)).astype(float)
    return depth, slope


@njit(cache=True, nogil=True)
def _fill_rays(
    out: NDArray[np.float32], rays: FloatArray, T_object_camera: FloatArray, boxes: IntArray
) -> None:
    at = 0
    for h in range(len(boxes)):
        T = T_object_camera[h]
        for v in range(boxes[h, 0], boxes[h, 1]):
            for u in range(boxes[h, 2], boxes[h, 3]):
                for i in range(3):
                    out[at, i] = T[i, 3]
                    out[at, 3 + i] = (
                        T[i, 0] * rays[v, u, 0] + T[i, 1] * rays[v, u, 1] + T[i, 2] * rays[v, u, 2]
                    )
                at += 1


@njit(cache=True, nogil=True)
def _visible_centroids(
    boxes: IntArray,
    depth: NDArray[np.float32],
    rays: FloatArray,
    labels: NDArray[np.int16],
    observed: FloatArray,
    default: FloatArray,
) -> FloatArray:
    result = default.copy()
    at = 0
    for h in range(len(boxes)):
        x, y, z, count = 0.0, 0.0, 0.0, 0
        for v in range(boxes[h, 0], boxes[h, 1]):
            for u in range(boxes[h, 2], boxes[h, 3]):
                d = depth[at]
                at += 1
                label = labels[v, u]
                cut_away = label == TABLE and abs(observed[v, u] - d) < NEAR_TABLE
                if np.isfinite(d) and label != NO_RETURN and not cut_away:
                    x += d * rays[v, u, 0]
                    y += d * rays[v, u, 1]
                    z += d
                    count += 1
        if count > 0:
            result[h, 0], result[h, 1], result[h, 2] = x / count, y / count, z / count
    return result
