"""How far depths lie from what poses predict, where a pixel may also mix front and back.

Beside an edge a sensor reports neither surface for sure, but something between them. Such a depth
is compared with the mean of what the pose predicts round about, and it may be off by as much as
anything between the nearest and the farthest of it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from reach.arrays import BoolArray, FloatArray
from registration.mesh_model import MeshModel
from registration.observation import FOREIGN, NO_RETURN, Observation
from registration.rendering import Rendered, render

STEEP = 5.7
"""Predicted depths of three pixels in a row that part by more pixel pitches are an edge's: a face
would be seen at less than 20 degrees from its plane."""
MIXING = 1 / 6
"""Variance of a depth at an edge, over the squared distance of front and back: 1/12 if it lies
anywhere between them, 1/4 if it is one of them."""
AROUND = 8
"""Pixels looked at around the part: they tell the errors that its own pixels share."""
GRAZING = 0.15


@dataclass(frozen=True, slots=True, eq=False)
class Views:
    """N poses against the image, over one rectangle of pixels.

    Args:
        residual: observed minus predicted depth, 0 where it says nothing, shape (N, h, w) [m].
        silent: pixels that say nothing, shape (h, w).
        off: pixels of a face in all poses, cut off in one, shape (h, w).
        mixing: variance of depths at edges of any of the poses, elsewhere 0, shape (h, w) [m^2].
        slope: least |normal . ray| of what the poses predict, for rays of unit depth, (h, w).
    """

    residual: FloatArray
    silent: BoolArray
    off: BoolArray
    mixing: FloatArray
    slope: FloatArray


class Viewer:
    """Compares poses with one image.

    Args:
        model: of the part.
        seen: the image's window.
        stride: of the pixels looked at.
        tolerance: differences from a face are cut off here [m].
    """

    def __init__(
        self, model: MeshModel, seen: Observation, *, stride: int, tolerance: float
    ) -> None:
        self._model, self._seen, self._stride = model, seen, stride
        self._tolerance = tolerance
        self._rays = seen.rays(stride)
        self._depth = seen.depth[::stride, ::stride]
        self._labels = seen.labels[::stride, ::stride]
        self._table_slope = np.abs((self._rays * seen.table.normal_camera).sum(axis=2))
        pitch = stride * float(seen.points[:, 2].mean()) / seen.frame.intrinsics.fx
        self._jump = STEEP * pitch

    def views(self, T_camera_object: FloatArray) -> Views:
        """Residuals of poses (N, 4, 4) that are to be compared with each other."""
        rendered = render(self._model, self._seen, T_camera_object, self._rays, self._stride)
        crop = self._around(rendered)
        depth, labels = self._depth[crop], self._labels[crop]
        predicted, slope, hit = self._predicted(rendered, crop)
        mean, extent = _round_about(predicted)
        edge = np.asarray(extent > self._jump)
        gap = depth - predicted
        through = hit & (gap > 0).all(axis=0)
        silent = (labels == NO_RETURN) | np.isnan(depth) | ((labels == FOREIGN) & ~through)
        # Between front and back of an edge a depth's error is known; elsewhere it is cut off.
        cut = np.clip(gap, -self._tolerance, self._tolerance)
        residual = np.where(silent, 0.0, np.where(edge, depth - mean, cut))
        off = ~edge & (np.abs(residual) >= self._tolerance).any(axis=0)
        mixing = np.where(edge, MIXING * extent**2, 0.0)
        return Views(residual, silent, off, mixing, np.maximum(slope, GRAZING))

    def _around(self, rendered: Rendered) -> tuple[slice, slice]:
        v0, u0 = rendered.boxes[:, [0, 2]].min(axis=0) - AROUND
        v1, u1 = rendered.boxes[:, [1, 3]].max(axis=0) + AROUND
        return slice(max(0, int(v0)), int(v1)), slice(max(0, int(u0)), int(u1))

    def _predicted(
        self, rendered: Rendered, crop: tuple[slice, slice]
    ) -> tuple[FloatArray, FloatArray, BoolArray]:
        """Depths (N, h, w) of part or table, least slopes (h, w), and where a part is hit (h, w)."""
        slope = self._table_slope[crop].copy()
        with np.errstate(divide="ignore"):
            table = np.abs(self._seen.table.offset_camera) / slope
        predicted = np.repeat(table[None], len(rendered.boxes), axis=0)
        hit = np.zeros(slope.shape, bool)
        at, top, left = 0, crop[0].start, crop[1].start
        for i, (v0, v1, u0, u1) in enumerate(rendered.boxes):
            box = slice(v0 - top, v1 - top), slice(u0 - left, u1 - left)
            shape = (int(v1 - v0), int(u1 - u0))
            part = slice(at, at + shape[0] * shape[1])
            at = part.stop
            depth = rendered.depth[part].reshape(shape)
            meets = np.isfinite(depth)
            predicted[i][box] = np.where(meets, depth, predicted[i][box])
            steep = rendered.slope[part].reshape(shape)
            slope[box] = np.where(meets, np.minimum(slope[box], steep), slope[box])
            hit[box] |= meets
        return predicted, slope, hit


def _round_about(depth: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Means (N, h, w) over each pixel and its eight neighbors, and the largest extent (h, w)."""
    import cv2

    window = np.ones((3, 3), np.uint8)
    mean = np.stack([cv2.blur(image, (3, 3)) for image in depth])
    extent = np.stack([cv2.dilate(image, window) - cv2.erode(image, window) for image in depth])
    return mean, extent.max(axis=0)
