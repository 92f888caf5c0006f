"""Two poses compared as well as the image allows: every pixel by what its error leaves of it.

The quick comparison (`registration.evidence`) sums what pixels say as if the wide patches of a
stereo camera's error hid all that is small. They do not: within a patch the error is nearly the
same, and a slot of two millimeters stands out. Weighing by the inverse of the errors' covariance
sees it. It also sees half a pixel of misalignment, so that poses are first aligned by it.
"""

from __future__ import annotations

import numpy as np

from reach.arrays import FloatArray
from reach.transforms import exp
from registration.mixed_pixels import Viewer, Views
from registration.search import Search
from registration.whitening import ErrorModel

PIXELS = 6000
"""Pixels of the part that are looked at, about."""
FACE_NOISE, OFF_NOISE = 0.25, 16.0
"""Variance of a depth's error by itself, beyond the table's noise, in units of that noise's: on
faces, and where one of the poses is off by more than the tolerance."""
MISPLACED = 0.16
"""Faces seen at a slant are off in depth by so many noise widths, over the slant's tangent."""
STEP = 0.25
"""Slides and turns by which the alignment moves the surface, in noise widths."""
LONGEST = 3.0
"""An alignment moves by at most so many steps at once."""
HOLD = 0.05
"""Information that holds a direction which the image does not tell, per squared step."""
ROUNDS = 3
"""Rounds of the alignment."""
ALIGNING, WEIGHING = 4, 8
"""Steps of the conjugate gradients in each round, and in the comparison."""


class CloseLook:
    """Aligns and weighs poses in one image.

    Args:
        search: whose image and part it is.
        bias: standard deviation of the error that all depths share [m].
    """

    def __init__(self, search: Search, bias: float) -> None:
        seen = search.seen
        self._stride = max(1, int(np.sqrt(len(seen.points) / PIXELS)))
        self._noise, self._bias = search.depth_noise, bias
        self._correlation = seen.table.correlation
        self._com, self._radius = search.model.obj.com, search.model.obj.diameter / 2
        self._axes = search.T_camera_table()[:3, :3]
        self._viewer = Viewer(
            search.model,
            seen,
            stride=self._stride,
            tolerance=search.fine_tolerance * search.depth_noise / search.noise,
        )

    def aligned(self, T: FloatArray, *, turning: bool = True) -> FloatArray:
        """The pose (4, 4) slid along the table, and turned on it, to where it fits best."""
        for _ in range(ROUNDS):
            steps = self._steps(T, turning=turning)
            moved = np.stack([T, *(T @ exp(step) for step in steps)])
            views = self._viewer.views(moved)
            residual = views.residual[0]
            slopes = views.residual[1:] - residual
            white = self._errors(views).undone(slopes, ALIGNING)
            information = (slopes[:, None] * white[None]).sum(axis=(2, 3))
            gradient = (white * residual).sum(axis=(1, 2))
            held = 0.5 * (information + information.T) + HOLD * np.eye(len(steps))
            length = np.clip(-np.linalg.solve(held, gradient), -LONGEST, LONGEST)
            T = T @ exp((length[:, None] * steps).sum(axis=0))
        return T

    def weigh(self, first: FloatArray, other: FloatArray) -> tuple[float, float]:
        """What the image says for one aligned pose (4, 4) against another.

        Were the first pose true, w . (r_first + r_other) with weights w would be normal about
        w . d, d = r_other - r_first, with variance 4 w . C w; were the other true, about -w . d.

        Returns:
            Share of the evidence to be expected that there is (1 if the first pose is true, -1
            if the other is), and the log odds.
        """
        views = self._viewer.views(np.stack([first, other]))
        apart = views.residual[1] - views.residual[0]
        errors = self._errors(views)
        weights = errors.undone(apart[None], WEIGHING)[0]
        mu = float((weights * apart).sum())
        if mu <= 0.0:
            return 0.0, 0.0
        gain = float((weights * views.residual.sum(axis=0)).sum())
        v = float((weights * errors.times(weights)).sum())
        v += (self._bias * float(weights.sum())) ** 2
        return gain / mu, gain * mu / (2.0 * v)

    def _steps(self, T: FloatArray, *, turning: bool) -> FloatArray:
        """Small slides and a turn (K, 6) of the pose, right perturbation."""
        axes = T[:3, :3].T @ self._axes
        shift = STEP * self._noise
        steps = [np.concatenate([np.zeros(3), shift * axes[:, i]]) for i in (0, 1)]
        if turning:
            turn = shift / self._radius * axes[:, 2]
            steps.append(np.concatenate([turn, np.cross(self._com, turn)]))
        return np.stack(steps)

    def _errors(self, views: Views) -> ErrorModel:
        variance = self._noise**2
        tangent2 = np.maximum(0.0, views.slope**-2.0 - 1.0)
        slanted = np.where(views.mixing > 0.0, 0.0, MISPLACED**2 * tangent2)
        own = np.where(views.off, OFF_NOISE, FACE_NOISE + slanted) * variance + views.mixing
        return ErrorModel(
            self._correlation, self._stride, variance=variance, own=own, known=~views.silent
        )
