"""What each part of the report shows, as plain values for the page's template."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from logs.report.charts import color_of
from logs.report.paper import PAPER_TABLE
from logs.report.views import grasp_picture, object_picture
from reach.arrays import FloatArray
from reach.evaluation.references import REFERENCE_NAMES
from reach.evaluation.table import Evaluation, ModelRow
from reach.models.names import JUDGES

if TYPE_CHECKING:
    from logs.dataset.dataset import Dataset
    from logs.dataset.labeled_trial import LabeledTrial

WORST = 4
"""Cards of false positives, and of false negatives."""
AT_LEAST_OFF = 0.3
"""A score that is off by less is no disagreement worth a picture."""


def gallery(dataset: Dataset) -> list[dict[str, Any]]:
    """Each object with its picture and success share, best first: the paper's Fig. 3."""
    cards = []
    for name, trials in dataset.by_object().items():
        lifted = sum(trial.label.success for trial in trials)
        grasps: dict[str, list[bool]] = {}
        for trial in sorted(trials, key=lambda t: (t.attempt, t.repeat)):
            grasps.setdefault(trial.grasp_id, []).append(trial.label.success)
        cards.append(
            {
                "name": name,
                "picture": object_picture(dataset, name),
                "lifted": lifted,
                "trials": len(trials),
                "share": lifted / len(trials),
                "grams": dataset.objects[name].mass * 1e3,
                "grasps": [
                    {"id": grasp, "share": sum(results) / len(results), "trials": len(results)}
                    for grasp, results in grasps.items()
                ],
                "reasons": _counts(t.label.reason for t in trials if not t.label.success),
            }
        )
    return sorted(cards, key=lambda card: (-card["share"], card["name"]))


def comparison(result: Evaluation) -> list[dict[str, Any]]:
    """The table's lines, with the paper's figures beside."""
    best = {
        key: _best(result, key, smallest=key in ("mae", "brier"))
        for key in ("ap", "ar", "f1", "mae", "brier")
    }
    return [
        {
            "name": row.name,
            "color": color_of(row.name),
            "reference": row.name in REFERENCE_NAMES,
            "cells": {
                key: {
                    "value": row.mean[key],
                    "interval": row.intervals[key],
                    "best": row.name not in REFERENCE_NAMES
                    and top is not None
                    and _rounded(row, key) == top,
                }
                for key, top in best.items()
            },
            "above": row.above_overlap.get("ap"),
            "majority": row.majority,
            "seconds": row.seconds_per_grasp,
            "paper": PAPER_TABLE.get(row.name),
            "parameters": ", ".join(f"{k} {_short(v)}" for k, v in row.parameters.items()),
        }
        for row in result.rows
    ]


def disagreements(result: Evaluation) -> dict[str, Any]:
    """Grasps that the preferred model misjudged most, with pictures."""
    model = preferred(result)
    off = model.scores - np.array([case.rate for case in result.cases])
    return {
        "model": model.name,
        "false_positives": [_card(result, i) for i in _worst(result, off)],
        "false_negatives": [_card(result, i) for i in _worst(result, -off)],
    }


def _worst(result: Evaluation, off: FloatArray) -> list[int]:
    """The grasps that are off most, the one tried more often first, no object twice."""
    trials = [case.trials for case in result.cases]
    found: dict[str, int] = {}
    for i in np.lexsort((-np.array(trials), -off)):
        if off[i] >= AT_LEAST_OFF:
            found.setdefault(result.cases[i].object_name, int(i))
    return list(found.values())[:WORST]


def preferred(result: Evaluation) -> ModelRow:
    """The row whose mistakes are shown: the best of ours that was evaluated."""
    by_name = {row.name: row for row in result.rows}
    return next((by_name[name] for name in JUDGES if name in by_name), result.rows[0])


def station(dataset: Dataset) -> dict[str, Any]:
    """What happened at the station besides success and failure."""
    trials = dataset.trials
    redone = [t for t in trials if t.redos]
    return {
        "redo_rate": len(redone) / len(trials),
        "redos": _counts(cause for t in trials for cause in t.redos),
        "redo_outcomes": _counts(outcome for t in trials for outcome in t.redo_outcomes),
        "redo_by_outcome": [
            {"outcome": name, "redone": sum(bool(t.redos) for t in part), "trials": len(part)}
            for name, part in _by_outcome(trials)
        ],
        "voids": _counts(cause for t in trials for cause in t.voids),
        "left_out": _counts(row.reason for row in dataset.left_out),
        "reasons": _counts(t.label.reason or "not said" for t in trials if not t.label.success),
        "relabeled": sum(t.label.relabeled > 0 for t in trials),
        "rotated": sum(t.label.rotated for t in trials),
        "sensor": _sensor_agreement(trials),
        "registration": _registration_errors(trials),
    }


def _by_outcome(trials: Sequence[LabeledTrial]) -> list[tuple[str, list[LabeledTrial]]]:
    return [
        ("lifted", [t for t in trials if t.label.success]),
        ("failed", [t for t in trials if not t.label.success]),
    ]


def _sensor_agreement(trials: Sequence[LabeledTrial]) -> tuple[int, int] | None:
    """How many labels the gripper's own verdict agrees with, of how many it judged."""
    judged = [t for t in trials if t.execution.sensor_verdict in ("held", "empty", "lost")]
    if not judged:
        return None
    agree = sum((t.execution.sensor_verdict == "held") == t.label.success for t in judged)
    return agree, len(judged)


def _registration_errors(trials: Sequence[LabeledTrial]) -> dict[str, float] | None:
    """Median and 95th percentile of the true registration error; known of a simulation only."""
    known = [
        (t.execution.translation_error, t.execution.rotation_error)
        for t in trials
        if t.execution.translation_error is not None and t.execution.rotation_error is not None
    ]
    if not known:
        return None
    translation, rotation = np.array(known).T
    return {
        "count": len(known),
        "translation_median": float(np.median(translation)) * 1e3,
        "translation_high": float(np.percentile(translation, 95)) * 1e3,
        "rotation_median": float(np.degrees(np.median(rotation))),
        "rotation_high": float(np.degrees(np.percentile(rotation, 95))),
    }


def _card(result: Evaluation, index: int) -> dict[str, Any]:
    case = result.cases[index]
    shown = [row for row in result.rows if row.name not in ("constant", "oracle")]
    return {
        "object": case.object_name,
        "grasp": case.grasp_id,
        "picture": grasp_picture(case),
        "successes": case.successes,
        "trials": case.trials,
        "scores": [
            {"name": row.name, "value": float(row.scores[index]), "color": color_of(row.name)}
            for row in shown
        ],
    }


def _best(result: Evaluation, key: str, *, smallest: bool) -> float | None:
    """The best value of a column as it is shown; references do not compete."""
    values = [_rounded(row, key) for row in result.rows if row.name not in REFERENCE_NAMES]
    known = [value for value in values if value is not None]
    if not known:
        return None
    return min(known) if smallest else max(known)


def _rounded(row: ModelRow, key: str) -> float | None:
    value = row.mean[key]
    return None if value is None else round(value, 2)


def _counts(values: Any) -> list[tuple[str, int]]:
    counted = Counter(str(value).replace("_", " ") for value in values if value is not None)
    return sorted(counted.items(), key=lambda item: (-item[1], item[0]))


def _short(value: float | bool | str) -> str:
    return f"{value:g}" if isinstance(value, float) and not isinstance(value, bool) else str(value)
