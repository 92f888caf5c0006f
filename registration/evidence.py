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
FACE_NOISE, EDGE_NOISE = 2.0, 16.0
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


class Weigher:
    """Weighs poses against each other in one image; what a pose predicts is rendered once.

    The log odds of two poses follow from S, the summed difference of squared residuals. Were the
    first pose true, S would be normal about mu = sum d^2, with d the poses' difference in depth;
    were the other true, about -mu. Its variance is 4 v, hence S mu / (2 v). In v is what the
    noise, correlated as on the table, makes of sum d e; what depths err beyond it, at edges above
    all; and the bias that all depths share.

    Args:
        model: of the part.
        seen: the image's window.
        tolerance: residuals are cut off here [m].
        noise: standard deviation of a depth [m].
        bias: standard deviation of the error that all depths share [m].
    """

    def __init__(
        self, model: MeshModel, seen: Observation, *, tolerance: float, noise: float, bias: float
    ) -> None:
        self._model, self._seen = model, seen
        self._tolerance, self._noise, self._bias = tolerance, noise, bias
        self._stride = max(1, int(np.sqrt(len(seen.points) / PIXELS)))
        area = seen.table.correlation_area
        few = FEW_PIXELS * max(1.0, area / 4) / self._stride**2
        self._few = max(few, FEW_PIXELS / 2)
        self._known: dict[bytes, _Prediction] = {}

    def weigh(self, T_camera_object: FloatArray, others: FloatArray) -> Evidence:
        """Evidence for a pose (4, 4) against each of N others (N, 4, 4)."""
        self._predict(np.concatenate([T_camera_object[None], others]))
        own = self._known[T_camera_object.tobytes()]
        pairs = [self._against(own, self._known[T.tobytes()]) for T in others]
        return Evidence(*np.array(pairs).reshape(-1, 2).T)

    def _predict(self, poses: FloatArray) -> None:
        new = {T.tobytes(): T for T in poses if T.tobytes() not in self._known}
        if new:
            T, rays = np.stack(list(new.values())), self._seen.rays(self._stride)
            rendered = render(self._model, self._seen, T, rays, self._stride)
            found = _predictions(self._seen, rendered, self._stride)
            self._known.update(zip(new, found, strict=True))

    def _against(self, own: _Prediction, other: _Prediction) -> tuple[float, float]:
        """Margin and log odds of one pose against another."""
        own_residual, rival = _residuals(own, other, self._tolerance)
        gain = rival**2 - own_residual**2
        full = self._tolerance**2
        differing = float(np.minimum(1.0, 2 * np.abs(gain) / full).sum())
        margin = float(gain.sum()) / full / (differing + self._few)
        apart = rival - own_residual
        mu = float((apart**2).sum())
        if mu == 0.0:
            return margin, 0.0
        at_edge = np.maximum(np.abs(own_residual), np.abs(rival)) >= self._tolerance
        extra = float((np.where(at_edge, EDGE_NOISE, FACE_NOISE) * apart**2).sum())
        noise = variance_of_sum(apart, self._seen.table.correlation, self._stride) + extra
        v = self._noise**2 * noise + (self._bias * float(apart.sum())) ** 2
        return margin, float(gain.sum()) * mu / (2 * v)


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
