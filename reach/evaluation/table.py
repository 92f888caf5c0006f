"""From scores to the comparison table: the paper's Table 1 on any labeled grasps."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from reach.arrays import FloatArray
from reach.errors import UnknownNameError
from reach.evaluation import metrics
from reach.evaluation.bootstrap import (
    DRAWS,
    METRIC_NAMES,
    OBJECT_METRICS,
    Interval,
    bootstrap,
    difference_intervals,
    interval_note,
    intervals,
)
from reach.evaluation.cases import GraspCase, Outcomes, check_scores
from reach.evaluation.gains import Gain, gains
from reach.evaluation.references import EXACT, REFERENCE_NAMES
from reach.evaluation.scored import Parameter, ScoredModel


@dataclass(frozen=True, slots=True, eq=False)
class ModelRow:
    """One line of the table.

    Args:
        name: of the model or reference.
        mean: metric -> average over objects; None where no object defines it. F1 is that of the
            two averages.
        intervals: metric -> 95 % bootstrap interval; None where the labels cannot tell it.
        above_overlap: metric -> 95 % bootstrap interval of the difference to the overlap row.
        majority: the same averages with one majority label a grasp.
        per_object: object -> metric -> value, None where undefined.
        seconds_per_grasp: wall time of one score, measured in this run.
        version: of the model.
        parameters: what the scores depend on.
        scores: shape (N,), in the order of the cases.
    """

    name: str
    mean: Mapping[str, float | None]
    intervals: Mapping[str, Interval]
    above_overlap: Mapping[str, Interval]
    majority: Mapping[str, float | None]
    per_object: Mapping[str, Mapping[str, float | None]]
    seconds_per_grasp: float
    version: str
    parameters: Mapping[str, Parameter]
    scores: FloatArray


@dataclass(frozen=True, slots=True, eq=False)
class Evaluation:
    """The whole comparison.

    Args:
        rows: models in the order asked for, then the references.
        cases: the labeled grasps, in the order of each row's scores.
        outcomes: the same grasps' labels by object.
        gains: of REACH over the point model, where both were evaluated.
        seed: of the bootstrap.
    """

    rows: tuple[ModelRow, ...]
    cases: tuple[GraspCase, ...]
    outcomes: Outcomes
    gains: tuple[Gain, ...]
    seed: int

    def row(self, name: str) -> ModelRow:
        """Return the row of a model.

        Raises:
            UnknownNameError: no such row.
        """
        for row in self.rows:
            if row.name == name:
                return row
        raise UnknownNameError("model", name, [row.name for row in self.rows])

    def to_json(self) -> dict[str, Any]:
        """The table as plain JSON values."""
        trials = sum(int(one.trials.sum()) for one in self.outcomes.objects)
        return {
            "models": {row.name: _row_json(row) for row in self.rows},
            "gains": [gain.to_json() for gain in self.gains],
            "references": [row.name for row in self.rows if row.name in REFERENCE_NAMES],
            "objects": {
                one.name: {
                    "grasps": len(one.trials),
                    "trials": int(one.trials.sum()),
                    "success_rate": float(one.successes.sum() / one.trials.sum()),
                }
                for one in self.outcomes.objects
            },
            "interval_note": interval_note(self.outcomes),
            "objects_without_positive": list(self.outcomes.without_positive),
            "grasps": len(self.cases),
            "trials": trials,
            "seed": self.seed,
            "scores": {
                case.grasp_id: {
                    "object": case.object_name,
                    "successes": case.successes,
                    "trials": case.trials,
                    **{row.name: float(row.scores[i]) for row in self.rows},
                }
                for i, case in enumerate(self.cases)
            },
        }


def tabulate(
    cases: Sequence[GraspCase],
    scored: Sequence[ScoredModel],
    *,
    seed: int = 0,
    draws: int = DRAWS,
) -> Evaluation:
    """Compute every metric of every model, with bootstrap intervals.

    Args:
        cases: N labeled grasps.
        scored: the models' scores in the same order.
        seed: of the bootstrap.
        draws: number of resamplings.

    Raises:
        InvalidInputError: no case, or a score outside [0, 1].
    """
    outcomes = Outcomes.of(cases)
    scores = {one.name: one.values for one in scored}
    check_scores(scores, len(cases))
    resampled = bootstrap(outcomes, scores, np.random.default_rng(seed), draws)
    rows = tuple(_row(one, outcomes, resampled) for one in scored)
    means = {row.name: row.mean for row in rows}
    return Evaluation(rows, tuple(cases), outcomes, gains(outcomes, means, resampled), seed)


def object_metrics(outcomes: Outcomes, scores: FloatArray) -> dict[str, dict[str, float | None]]:
    """Metrics per object: object -> metric -> value, None where undefined."""
    result = {}
    for one, values in zip(outcomes.objects, outcomes.split(scores), strict=True):
        row = {
            key: _defined(metric(one, values, None)[0]) for key, metric in OBJECT_METRICS.items()
        }
        ap, ar = row["ap"], row["ar"]
        both = ap is not None and ar is not None
        row["f1"] = _defined(float(metrics.f1(np.array(ap), np.array(ar)))) if both else None
        result[one.name] = row
    return result


def mean_metrics(outcomes: Outcomes, scores: FloatArray) -> dict[str, float | None]:
    """Averages over the objects for which a metric is defined; F1 of the two averages."""
    per_object = object_metrics(outcomes, scores)
    mean: dict[str, float | None] = {}
    for key in OBJECT_METRICS:
        values = [row[key] for row in per_object.values()]
        known = [value for value in values if value is not None]
        mean[key] = float(np.mean(known)) if known else None
    ap, ar = mean["ap"], mean["ar"]
    both = ap is not None and ar is not None
    mean["f1"] = _defined(float(metrics.f1(np.array(ap), np.array(ar)))) if both else None
    return {key: mean[key] for key in METRIC_NAMES}


def _row(
    one: ScoredModel, outcomes: Outcomes, resampled: Mapping[str, Mapping[str, FloatArray]]
) -> ModelRow:
    drawn = resampled[one.name]
    overlap = resampled.get("overlap")
    above: dict[str, Interval] = {}
    if overlap is not None and one.name not in REFERENCE_NAMES:
        above = difference_intervals(outcomes, drawn, overlap)
    return ModelRow(
        one.name,
        mean_metrics(outcomes, one.values),
        intervals(outcomes, drawn, EXACT.get(one.name, ())),
        above,
        mean_metrics(outcomes.majority(), one.values),
        object_metrics(outcomes, one.values),
        one.seconds_per_grasp,
        one.version,
        one.parameters,
        one.values,
    )


def _row_json(row: ModelRow) -> dict[str, Any]:
    return {
        **row.mean,
        "seconds_per_grasp": row.seconds_per_grasp,
        "intervals": {key: value and list(value) for key, value in row.intervals.items()},
        "above_overlap": {key: value and list(value) for key, value in row.above_overlap.items()},
        "majority": dict(row.majority),
        "per_object": {name: dict(values) for name, values in row.per_object.items()},
        "version": row.version,
        "parameters": dict(row.parameters),
    }


def _defined(value: float) -> float | None:
    return float(value) if np.isfinite(value) else None
