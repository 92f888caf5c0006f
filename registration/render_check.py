"""Render a hypothesis from the camera and compare it with the depth image, pixel by pixel.

A fitness score of points does not tell right from wrong; what does is that the part, standing
there, would have been seen: no depth reaches through it (free space), nothing but it explains
the points above the table, and what hides it stands in front of it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numba import njit
from numpy.typing import NDArray

from reach.arrays import FloatArray, IntArray
from reach.transforms import inverse
from registration.mesh_model import MeshModel
from registration.observation import NO_RETURN, PART, TABLE, Observation

SHADOW_WEIGHT = 0.1
"""Weight of a pixel of the part without a return: shadows and grazing faces are common."""
HIDDEN_WEIGHT = 0.15
"""Weight of a pixel of the part that something else hides."""
GRAZING = 0.3
"""Depth residuals count along the surface normal, but never less than this share of them."""
NEAR_TABLE = 4e-3
"""A predicted depth this close to the table's was cut away with it [m]."""
_COLUMNS = 9


@dataclass(frozen=True, slots=True, eq=False)
class RenderCheck:
    """How well each of N hypotheses explains the image; arrays of shape (N,).

    Args:
        cost: mean robust disagreement of the pixels concerned, 0 (perfect) to 1.
        observed_overlap: share of the candidate's pixels that the hypothesis explains.
        model_overlap: share of the hypothesis's visible pixels with a return that agree.
        free_space_violation: share of its pixels with a return through which the camera saw.
        hidden: share of its pixels that something else hides.
        rmse: of the depths that agree, along the surface normal [m].
    """

    cost: FloatArray
    observed_overlap: FloatArray
    model_overlap: FloatArray
    free_space_violation: FloatArray
    hidden: FloatArray
    rmse: FloatArray


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


def render_check(
    model: MeshModel,
    seen: Observation,
    T_camera_object: FloatArray,
    *,
    stride: int,
    tolerance: float,
) -> RenderCheck:
    """Compare hypotheses with the image.

    Args:
        model: of the part.
        seen: the image's window.
        T_camera_object: hypotheses, shape (N, 4, 4).
        stride: every stride-th pixel along rows and columns is compared.
        tolerance: depths that differ by more disagree fully [m].
    """
    rays = seen.rays(stride)
    depth = np.ascontiguousarray(seen.depth[::stride, ::stride])
    labels = np.ascontiguousarray(seen.labels[::stride, ::stride])
    rendered = render(model, seen, T_camera_object, rays, stride)
    sums = _compare(
        rendered.depth,
        rendered.slope,
        rendered.boxes,
        depth,
        labels,
        int((labels == PART).sum()),
        tolerance,
    )
    return _summary(sums)


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


@njit(cache=True, nogil=True)
def _compare(
    hit: NDArray[np.float32],
    slope: FloatArray,
    boxes: IntArray,
    depth: FloatArray,
    labels: NDArray[np.int16],
    own_pixels: int,
    tolerance: float,
) -> FloatArray:
    """Sums (N, 9) over pixels; see _summary for the columns."""
    sums = np.zeros((len(boxes), _COLUMNS))
    at = 0
    for h in range(len(boxes)):
        inside = 0
        s = sums[h]
        for v in range(boxes[h, 0], boxes[h, 1]):
            for u in range(boxes[h, 2], boxes[h, 3]):
                predicted, facing = hit[at], slope[at]
                at += 1
                label = labels[v, u]
                is_own = label == PART
                inside += is_own
                if not np.isfinite(predicted):
                    if is_own:  # a point that the hypothesis leaves unexplained
                        s[0] += 1.0
                        s[1] += 1.0
                        s[2] += 1.0
                    continue
                s[8] += 1.0
                if label == NO_RETURN:
                    s[0] += SHADOW_WEIGHT
                    s[1] += SHADOW_WEIGHT
                    continue
                gap = (depth[v, u] - predicted) * max(facing, GRAZING)
                if gap < -tolerance and not is_own:  # something else stands in front
                    s[0] += HIDDEN_WEIGHT
                    s[1] += HIDDEN_WEIGHT
                    s[7] += 1.0
                    continue
                loss = min(1.0, (gap / tolerance) ** 2)
                agrees = loss < 1.0
                s[0] += 1.0
                s[1] += loss
                s[2] += is_own
                s[3] += is_own and agrees
                s[4] += 1.0
                if agrees:
                    s[5] += 1.0
                    s[6] += gap * gap
        outside = own_pixels - inside
        s[0] += outside
        s[1] += outside
        s[2] += outside
    return sums


def _summary(sums: FloatArray) -> RenderCheck:
    weight, cost, own, own_agrees, judged, agrees, squares, hidden, pixels = sums.T
    return RenderCheck(
        cost=np.where(judged > 0, cost / np.maximum(weight, 1e-9), 1.0),
        observed_overlap=own_agrees / np.maximum(own, 1.0),
        model_overlap=agrees / np.maximum(judged, 1.0),
        free_space_violation=(judged - agrees) / np.maximum(judged, 1.0),
        hidden=hidden / np.maximum(pixels, 1.0),
        rmse=np.sqrt(squares / np.maximum(agrees, 1.0)),
    )
