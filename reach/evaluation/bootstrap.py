"""Bootstrap intervals: objects are drawn with replacement, then each one's grasps.

All models see the same draws, so that the interval of a difference is narrower than the two
intervals suggest, as it should be.

A grasp's trials are not drawn again: what chance did to them scatters the observed grasps already,
and drawing them would count it twice. On made-up data (10 objects of 10 grasps of 5 trials) the
stated deviation is 1.2 to 1.3 times the true one; with trials drawn as well 1.4 to 1.7 times.

Percentiles of a mean over few objects are too narrow by the same factor as a normal instead of
Student's interval with a deviation over n instead of n - 1: the percentiles are moved out by that
factor ([Hesterberg2015] Sect. 4.5). Fewer objects than [FEWEST_OBJECTS][] have no interval. And
where every object has the best possible value, all draws agree, and tell nothing of the objects
that would not: then the far end is the exact binomial bound of the share of objects that have it.

Sources:
    [Hesterberg2015] Hesterberg, What teachers should know about the bootstrap, The American
    Statistician 69(4).
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping

import numpy as np

from reach.arrays import FloatArray
from reach.evaluation import metrics
from reach.evaluation.cases import ObjectOutcomes, Outcomes

DRAWS = 2000

Interval = tuple[float, float] | None
"""Low and high end; None where the labels cannot tell one."""
LEVEL = 0.95
FEWEST_OBJECTS = 5
"""Below which no interval is stated: of three objects percentiles cover the truth in 76 to 92 % of
made-up experiments (AP, AR), and widened they span .34 to .57: that is no news."""
METRIC_NAMES = ("ap", "ar", "f1", "mae", "brier")
_OF_POSITIVES = ("ap", "ar", "f1")
_ROUNDING = 1e-9
Metric = Callable[[ObjectOutcomes, FloatArray, FloatArray | None], FloatArray]

OBJECT_METRICS: Mapping[str, Metric] = {
    "ap": metrics.average_precision,
    "ar": metrics.average_recall,
    "mae": metrics.mean_absolute_error,
    "brier": metrics.brier,
}
"""What is computed per object and averaged over objects; F1 follows from the averages."""


def bootstrap(
    outcomes: Outcomes,
    scores: Mapping[str, FloatArray],
    rng: np.random.Generator,
    draws: int = DRAWS,
) -> dict[str, dict[str, FloatArray]]:
    """Metrics of every model in each of many resamplings.

    Args:
        outcomes: of the whole data set, O objects.
        scores: shape (N,) by model.
        rng: where the draws come from.
        draws: number B of resamplings.

    Returns:
        model -> metric (ap, ar, f1, mae, brier) -> shape (B,). An object drawn twice has its
        grasps drawn twice, independently; one without a positive sample is left out of AP and
        AR in that draw.
    """
    count = len(outcomes.objects)
    chosen = rng.integers(count, size=(draws, count))
    split = {name: outcomes.split(values) for name, values in scores.items()}
    sums = {(m, k): np.zeros(draws) for m in scores for k in OBJECT_METRICS}
    sizes = {(m, k): np.zeros(draws) for m in scores for k in OBJECT_METRICS}
    for position, one in enumerate(outcomes.objects):
        draw_index, _ = np.nonzero(chosen == position)
        grasps = len(one.trials)
        weights = rng.multinomial(grasps, np.full(grasps, 1 / grasps), size=len(draw_index))
        for model, per_object in split.items():
            for key, metric in OBJECT_METRICS.items():
                values = metric(one, per_object[position], weights.astype(float))
                defined = np.isfinite(values)
                np.add.at(sums[model, key], draw_index[defined], values[defined])
                np.add.at(sizes[model, key], draw_index[defined], 1)
    result = {}
    for model in scores:
        rows = {key: metrics.ratio(sums[model, key], sizes[model, key]) for key in OBJECT_METRICS}
        rows["f1"] = metrics.f1(rows["ap"], rows["ar"])
        result[model] = rows
    return result


def intervals(
    outcomes: Outcomes, drawn: Mapping[str, FloatArray], exact: Collection[str] = ()
) -> dict[str, Interval]:
    """Interval of every metric of a model.

    Args:
        outcomes: of the data set.
        drawn: metric -> values in all resamplings, of [bootstrap][].
        exact: metrics whose value follows from the model's definition, whatever the labels.
    """
    return {
        key: None
        if key in exact or (key == "ap" and not _any_failed(outcomes))
        else interval(drawn[key], _objects_telling(outcomes, key), bounded=True)
        for key in METRIC_NAMES
    }


def difference_intervals(
    outcomes: Outcomes, first: Mapping[str, FloatArray], second: Mapping[str, FloatArray]
) -> dict[str, Interval]:
    """Interval of the difference of two models in every metric, both under the same draws."""
    return {
        key: interval(first[key] - second[key], _objects_telling(outcomes, key))
        for key in METRIC_NAMES
    }


def interval(values: FloatArray, objects: int, *, bounded: bool = False) -> Interval:
    """Interval of a mean over objects from its resampled values.

    Args:
        values: shape (B,), NaN where a draw does not define it.
        objects: that the mean is over.
        bounded: whether each object's value is in [0, 1], as opposed to a difference.
    """
    from scipy.stats import norm, t

    defined = values[np.isfinite(values)]
    if objects < FEWEST_OBJECTS or not len(defined):
        return None
    low, high = float(defined.min()), float(defined.max())
    if high - low < _ROUNDING:
        return _at_bound(low, objects) if bounded else None
    widening = np.sqrt(objects / (objects - 1))
    tail = 100.0 * float(norm.cdf(widening * t.ppf(0.5 * (1.0 - LEVEL), objects - 1)))
    low, high = np.percentile(defined, [tail, 100.0 - tail]).tolist()
    return low, high


def interval_note(outcomes: Outcomes) -> str:
    """What a reader must know of the intervals beside these labels' figures: one sentence or two."""
    count = _objects_telling(outcomes, "ap")
    if count < FEWEST_OBJECTS:
        return (
            f"No intervals: too few objects ({count} with a success, it takes {FEWEST_OBJECTS}) to "
            "tell how much objects scatter."
        )
    note = (
        "Intervals: 95 %, bootstrap over objects, then their grasps, widened for the number of "
        f"objects ({count}); where every object has the best value, the far end is the exact "
        "binomial bound."
    )
    return note if _any_failed(outcomes) else note + " No trial failed: AP tells nothing."


def _at_bound(value: float, objects: int) -> Interval:
    """Interval where every object has a metric's least or greatest value; None between them."""
    share = (0.5 * (1.0 - LEVEL)) ** (1.0 / objects)  # Clopper and Pearson's, all of n
    if value < _ROUNDING:
        return 0.0, 1.0 - share
    return (share, 1.0) if value > 1.0 - _ROUNDING else None


def _objects_telling(outcomes: Outcomes, key: str) -> int:
    """Number of objects that define a metric."""
    undefined = len(outcomes.without_positive) if key in _OF_POSITIVES else 0
    return len(outcomes.objects) - undefined


def _any_failed(outcomes: Outcomes) -> bool:
    """Whether any trial failed; else AP is 1 whatever the scores."""
    return any(bool((one.successes < one.trials).any()) for one in outcomes.objects)
