"""Which of two poses does the image speak for? Only pixels where they differ can tell."""

from __future__ import annotations

import numpy as np

from reach.arrays import FloatArray
from registration.mesh_model import MeshModel
from registration.observation import FOREIGN, NO_RETURN, PART, Observation
from registration.render_check import GRAZING
from registration.rendering import Rendered, render

FEW_PIXELS = 12
"""So many differing pixels of full disagreement make a margin of one half."""
PIXELS = 16_000
"""Pixels of the part that are looked at, about: small features decide."""


def pairwise_margins(
    model: MeshModel,
    seen: Observation,
    T_camera_object: FloatArray,
    tolerance: float,
) -> FloatArray:
    """Evidence for the first pose against each of the others.

    The difference of the two poses' summed losses, divided by the number of pixels where the
    losses differ (plus a few, so that a handful of pixels proves nothing): 1 means that every
    pixel that can tell speaks for the first pose, 0 that none can or that they contradict.

    Args:
        model: of the part.
        seen: the image's window.
        T_camera_object: shape (N, 4, 4), N >= 1.
        tolerance: depths that differ by more disagree fully [m].

    Returns:
        Shape (N - 1,), each in [-1, 1].
    """
    stride = max(1, int(np.sqrt(len(seen.points) / PIXELS)))
    rendered = render(model, seen, T_camera_object, seen.rays(stride), stride)
    losses = _losses(seen, rendered, stride, tolerance)
    few = FEW_PIXELS * max(1.0, seen.table.correlation_area / 4) / stride**2
    few = max(few, FEW_PIXELS / 2)
    margins = np.zeros(len(losses) - 1)
    for i, other in enumerate(losses[1:]):
        difference = other - losses[0]
        differing = float(np.minimum(1.0, 2 * np.abs(difference)).sum())
        margins[i] = difference.sum() / (differing + few)
    return margins


def _losses(
    seen: Observation, rendered: Rendered, stride: int, tolerance: float
) -> list[FloatArray]:
    """Loss of every pixel of the strided window, in [0, 1], for each hypothesis."""
    depth = seen.depth[::stride, ::stride]
    labels = seen.labels[::stride, ::stride]
    unexplained = (labels == PART).astype(float)
    result, at = [], 0
    for v0, v1, u0, u1 in rendered.boxes:
        shape = (int(v1 - v0), int(u1 - u0))
        count = shape[0] * shape[1]
        hit = rendered.depth[at : at + count].reshape(shape).astype(float)
        slope = rendered.slope[at : at + count].reshape(shape)
        at += count
        box = labels[v0:v1, u0:u1]
        with np.errstate(invalid="ignore"):
            gap = (depth[v0:v1, u0:u1] - hit) * np.maximum(slope, GRAZING)
            inside = np.minimum(1.0, (gap / tolerance) ** 2)
            silent = (box == NO_RETURN) | ((box == FOREIGN) & (gap < 0))
        inside = np.where(silent, 0.0, inside)
        loss = unexplained.copy()
        loss[v0:v1, u0:u1] = np.where(np.isfinite(hit), inside, unexplained[v0:v1, u0:u1])
        result.append(loss)
    return result
