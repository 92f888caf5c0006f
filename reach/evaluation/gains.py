"""Does REACH recall more than a point contact model at no loss of precision, as the paper found?

[Danielczuk2019] Table 1: average recall .72 against .55 at average precision .77 against .76, and
for the robust variants .66 against .55 at .82 against .82.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

from reach.arrays import FloatArray
from reach.evaluation.bootstrap import Interval, difference_intervals
from reach.evaluation.cases import Outcomes

PAIRS = (("reach", "point"), ("reach-robust", "point-robust"))
RECALL_GAIN = 0.11
"""The smaller of the paper's two gains in average recall."""


@dataclass(frozen=True, slots=True)
class Gain:
    """What one model gains over another on the same labels.

    Args:
        model: the one.
        rival: the other.
        ap: difference of average precision; None where one of them is undefined.
        ar: difference of average recall.
        ap_interval: 95 % bootstrap interval of it, both models under the same draws.
        ar_interval: the same.
    """

    model: str
    rival: str
    ap: float | None
    ar: float | None
    ap_interval: Interval
    ar_interval: Interval

    @property
    def as_published(self) -> bool | None:
        """Recall gained by .11 or more at no loss of precision; None where undefined."""
        if self.ap is None or self.ar is None:
            return None
        return self.ar >= RECALL_GAIN and self.ap >= 0.0

    @property
    def certain(self) -> bool:
        """Whether both intervals lie where the finding does; without intervals they do not."""
        ar, ap = self.ar_interval, self.ap_interval
        return ar is not None and ap is not None and ar[0] >= RECALL_GAIN and ap[0] >= 0.0

    def to_json(self) -> dict[str, Any]:
        """The gain as plain JSON values."""
        return {
            "model": self.model,
            "rival": self.rival,
            "ap": self.ap,
            "ar": self.ar,
            "ap_interval": self.ap_interval and list(self.ap_interval),
            "ar_interval": self.ar_interval and list(self.ar_interval),
            "as_published": self.as_published,
            "certain": self.certain,
        }


def gains(
    outcomes: Outcomes,
    means: Mapping[str, Mapping[str, float | None]],
    resampled: Mapping[str, Mapping[str, FloatArray]],
    pairs: Iterable[tuple[str, str]] = PAIRS,
) -> tuple[Gain, ...]:
    """Gains of those pairs of which both models were evaluated.

    Args:
        outcomes: of the data set.
        means: model -> metric -> average over objects.
        resampled: model -> metric -> the same in each of B resamplings, shape (B,).
        pairs: (model, rival).
    """
    return tuple(
        _gain(outcomes, means, resampled, model, rival)
        for model, rival in pairs
        if model in means and rival in means
    )


def _gain(
    outcomes: Outcomes,
    means: Mapping[str, Mapping[str, float | None]],
    resampled: Mapping[str, Mapping[str, FloatArray]],
    model: str,
    rival: str,
) -> Gain:
    bounds = difference_intervals(outcomes, resampled[model], resampled[rival])
    return Gain(
        model,
        rival,
        _difference(means[model]["ap"], means[rival]["ap"]),
        _difference(means[model]["ar"], means[rival]["ar"]),
        bounds["ap"],
        bounds["ar"],
    )


def _difference(a: float | None, b: float | None) -> float | None:
    return None if a is None or b is None else a - b
