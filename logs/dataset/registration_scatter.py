"""What a station's own registrations say of its pose error.

The scatter of tilt and height of parts at rest is an error that was really made (see
[logs.dataset.registration_residual][]). In the other three directions, in the table's plane and
turning on it, only what registration claims of itself is known.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from logs.dataset.labeled_trial import LabeledTrial
from logs.dataset.registration_residual import claimed_variances, resting_residual
from reach.arrays import FloatArray

FEWEST = 5


@dataclass(frozen=True, slots=True)
class Spread:
    """A standard deviation with its 95 % interval.

    Args:
        value: root mean square about the planned value.
        low: lower end.
        high: upper end.
        bias: mean, the part of it that repeats could be corrected by.
        count: of registrations.
    """

    value: float
    low: float
    high: float
    bias: float
    count: int

    def to_json(self) -> dict[str, Any]:
        """The spread as plain JSON values."""
        return {
            "value": self.value,
            "interval": [self.low, self.high],
            "bias": self.bias,
            "count": self.count,
        }


@dataclass(frozen=True, slots=True)
class RegistrationScatter:
    """Observed and claimed errors of a station's registrations; None where nothing is known.

    Args:
        tilt: observed, about one horizontal axis [rad].
        height: observed [m].
        claimed_rotation: root mean square of what the registrations state [rad].
        claimed_translation: the same [m].
        true_rotation: measured against the truth, simulated stations only [rad].
        true_translation: the same [m].
    """

    tilt: Spread | None
    height: Spread | None
    claimed_rotation: float | None
    claimed_translation: float | None
    true_rotation: Spread | None
    true_translation: Spread | None


def registration_scatter(trials: Sequence[LabeledTrial]) -> RegistrationScatter:
    """Measure it over the trials that were registered on their planned side."""
    residuals = [one for one in map(resting_residual, trials) if one is not None]
    tilts = [angle for one in residuals for angle in (one.tilt_x, one.tilt_y)]
    heights = [one.height for one in residuals]
    claimed = claimed_variances(trials)
    rotation, translation = (None, None) if claimed is None else _deviations(claimed[0])
    axes = np.sqrt(3.0)  # errors are lengths of vectors; a spread is of one coordinate
    return RegistrationScatter(
        _spread(tilts),
        _spread(heights),
        rotation,
        translation,
        _spread([t.execution.rotation_error / axes for t in trials if t.execution.rotation_error]),
        _spread(
            [t.execution.translation_error / axes for t in trials if t.execution.translation_error]
        ),
    )


def _deviations(variances: FloatArray) -> tuple[float, float]:
    """Root mean square of one angle [rad] and of one coordinate [m]."""
    return float(np.sqrt(variances[:3].mean())), float(np.sqrt(variances[3:].mean()))


def _spread(values: Sequence[float]) -> Spread | None:
    if len(values) < FEWEST:
        return None
    from scipy.stats import chi2

    n = len(values)
    square = float(np.square(values).sum())
    low, high = (float(np.sqrt(square / chi2.ppf(p, n))) for p in (0.975, 0.025))
    return Spread(float(np.sqrt(square / n)), low, high, float(np.mean(values)), n)
