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
from registration.mesh_model import MeshModel
from registration.observation import NO_RETURN, PART, Observation
from registration.rendering import render

SHADOW_WEIGHT = 0.1
"""Weight of a pixel of the part without a return: shadows and grazing faces are common."""
HIDDEN_WEIGHT = 0.15
"""Weight of a pixel of the part that something else hides."""
GRAZING = 0.3
"""Depth residuals count along the surface normal, but never less than this share of them."""
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
