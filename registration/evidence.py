"""Which of two poses does the image speak for? Only pixels where they differ can tell."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from reach.arrays import FloatArray
from registration.correlation import variance_of_sum
from registration.mesh_model import MeshModel
from registration.observation import FOREIGN, NO_RETURN, Observation
from registration.render_check import GRAZING
from registration.rendering import Rendered, render

FEW_PIXELS = 12
"""So many differing pixels of full disagreement make a margin of one half."""
FACE_NOISE, EDGE_NOISE = 2.0, 32.0
"""Variance of a depth's error beyond the table's noise, in units of that noise's, for each pixel by
itself: on faces, and where one of the poses is off by more than the tolerance, as beside edges,
where depths of front and back mix. Measured: decision 0044."""
PIXELS = 16_000
"""Pixels of the part that are looked at, about: small features decide."""


@dataclass(frozen=True, slots=True, eq=False)
class Evidence:
    """What the image says for one pose against N others.

    Args:
        margin: difference of the two poses' summed losses, divided by the number of pixels whose
            losses differ (plus a few, so that a handful proves nothing), shape (N,): 1 means
            that every pixel that can tell speaks for the first pose, 0 that none can or that
            they contradict.
        log_odds: natural logarithm of how much more likely the image is under the first pose,
            given the noise and its correlation, shape (N,).
    """

    margin: FloatArray
    log_odds: FloatArray


@dataclass(frozen=True, slots=True, eq=False)
class _Prediction:
    """What one pose predicts at every pixel (h, w): the part where it is hit, else the table.

    Args:
        gap: observed minus predicted depth [m], 0 where the pixel says nothing.
        slope: |normal . ray| of what is predicted, for rays of unit depth.
    """

    gap: FloatArray
    slope: FloatArray


def compare(
    model: MeshModel,
    seen: Observation,
    T_camera_object: FloatArray,
    *,
    tolerance: float,
    noise: float,
    bias: float,
) -> Evidence:
    """Weigh the first pose against each of the others, pixel by pixel.

    The log odds follow from S, the summed difference of squared residuals. Were the first pose
    true, S would be normal about mu = sum d^2, with d the poses' difference in depth; were the
    other true, about -mu. Its variance is 4 v, hence S mu / (2 v). In v is what the noise,
    correlated as on the table, makes of sum d e; what depths err beyond it, at edges above all;
    and the bias that all depths share.

    Args:
        model: of the part.
        seen: the image's window.
        T_camera_object: shape (N + 1, 4, 4).
        tolerance: residuals are cut off here [m].
        noise: standard deviation of a depth [m].
        bias: standard deviation of the error that all depths share [m].
    """
    stride = max(1, int(np.sqrt(len(seen.points) / PIXELS)))
    rendered = render(model, seen, T_camera_object, seen.rays(stride), stride)
    predictions = _predictions(seen, rendered, stride)
    correlation = seen.table.correlation
    few = max(FEW_PIXELS * max(1.0, seen.table.correlation_area / 4) / stride**2, FEW_PIXELS / 2)
    count = len(predictions) - 1
    margin, log_odds = np.zeros(count), np.zeros(count)
    for i, other in enumerate(predictions[1:]):
        own, rival = _residuals(predictions[0], other, tolerance)
        gain = rival**2 - own**2
        differing = float(np.minimum(1.0, 2 * np.abs(gain) / tolerance**2).sum())
        margin[i] = gain.sum() / tolerance**2 / (differing + few)
        apart = rival - own
        at_edge = np.maximum(np.abs(own), np.abs(rival)) >= tolerance
        errs = np.where(at_edge, EDGE_NOISE, FACE_NOISE) * apart**2
        mu = float((apart**2).sum())
        v = noise**2 * (variance_of_sum(apart, correlation, stride) + float(errs.sum()))
        v += (bias * float(apart.sum())) ** 2
        log_odds[i] = gain.sum() * mu / (2 * v) if mu > 0 else 0.0
    return Evidence(margin, log_odds)


def _residuals(a: _Prediction, b: _Prediction, tolerance: float) -> tuple[FloatArray, FloatArray]:
    """Residuals (h, w) of two poses, cut off; 0 where they predict the same."""
    differ = a.gap != b.gap
    # The steeper of the two views, so that a grazing face alone decides nothing.
    slope = np.where(differ, np.maximum(np.minimum(a.slope, b.slope), GRAZING), 0.0)
    return (
        np.clip(a.gap * slope, -tolerance, tolerance),
        np.clip(b.gap * slope, -tolerance, tolerance),
    )


def _predictions(seen: Observation, rendered: Rendered, stride: int) -> list[_Prediction]:
    """Of each hypothesis, over the strided window."""
    labels = seen.labels[::stride, ::stride]
    depth = seen.depth[::stride, ::stride]
    table_slope = np.abs((seen.rays(stride) * seen.table.normal_camera).sum(axis=2))
    with np.errstate(divide="ignore"):
        table_depth = np.abs(seen.table.offset_camera) / table_slope
    # What stands on the table beside the part is explained by itself, unless the part would
    # have hidden it.
    empty = np.where((labels == NO_RETURN) | (labels == FOREIGN), 0.0, depth - table_depth)
    result, at = [], 0
    for v0, v1, u0, u1 in rendered.boxes:
        shape = (int(v1 - v0), int(u1 - u0))
        count = shape[0] * shape[1]
        hit = rendered.depth[at : at + count].reshape(shape).astype(float)
        steep = rendered.slope[at : at + count].reshape(shape)
        at += count
        box = labels[v0:v1, u0:u1]
        gap, slope = empty.copy(), table_slope.copy()
        inside = depth[v0:v1, u0:u1] - hit
        silent = (box == NO_RETURN) | ((box == FOREIGN) & ~(inside > 0))
        meets = np.isfinite(hit)
        gap[v0:v1, u0:u1] = np.where(meets, np.where(silent, 0.0, inside), gap[v0:v1, u0:u1])
        slope[v0:v1, u0:u1] = np.where(meets, steep, slope[v0:v1, u0:u1])
        result.append(_Prediction(gap, slope))
    return result
