"""What a station's own registrations say of its pose error.

A part at rest on the table has its planned tilt and height, whatever the operator's hand did: the
scatter of the registered tilt and height is an error that was really made. The other three
directions (in the table's plane, and turning on it) are placed anew every time, and only what
registration claims of itself is known there.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from logs.dataset.labeled_trial import LabeledTrial
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
    tilts: list[float] = []
    heights: list[float] = []
    for trial in trials:
        residual = _residual(trial)
        if residual is not None:
            tilts += residual[:2].tolist()
            heights.append(float(residual[2]))
    covariances = [t.execution.covariance for t in trials if t.execution.covariance is not None]
    claimed = _claimed(covariances)
    axes = np.sqrt(3.0)  # errors are lengths of vectors; a spread is of one coordinate
    return RegistrationScatter(
        _spread(tilts),
        _spread(heights),
        *claimed,
        _spread([t.execution.rotation_error / axes for t in trials if t.execution.rotation_error]),
        _spread(
            [t.execution.translation_error / axes for t in trials if t.execution.translation_error]
        ),
    )


def _residual(trial: LabeledTrial) -> FloatArray | None:
    """Tilt about the world's x and y [rad], and height [m], of the registered against the plan."""
    registered, planned = trial.execution.T_world_object, trial.T_world_object
    if registered is None or registered[2, :3] @ planned[2, :3] < 0.9:
        return None
    # The vertical in the object's frame, as planned and as registered: what turns one into the
    # other is the tilt, free of how the part was turned on the table.
    turn = np.cross(planned[2, :3], registered[2, :3])
    tilt = planned[:3, :3] @ turn
    return np.array([tilt[0], tilt[1], registered[2, 3] - planned[2, 3]])


def _claimed(covariances: Sequence[FloatArray]) -> tuple[float | None, float | None]:
    if not covariances:
        return None, None
    diagonals = np.array([np.diag(covariance) for covariance in covariances])
    variances = np.where(np.isfinite(diagonals), diagonals, 0.0).mean(axis=0)
    return float(np.sqrt(variances[:3].mean())), float(np.sqrt(variances[3:].mean()))


def _spread(values: Sequence[float]) -> Spread | None:
    if len(values) < FEWEST:
        return None
    from scipy.stats import chi2

    n = len(values)
    square = float(np.square(values).sum())
    low, high = (float(np.sqrt(square / chi2.ppf(p, n))) for p in (0.975, 0.025))
    return Spread(float(np.sqrt(square / n)), low, high, float(np.mean(values)), n)
