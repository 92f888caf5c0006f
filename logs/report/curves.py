"""Precision against recall, and what a score means: the two plots of an evaluation."""

from __future__ import annotations

import numpy as np

from logs.report.charts import color_of, dashes_of, figure, to_svg
from reach.arrays import FloatArray
from reach.evaluation import metrics
from reach.evaluation.cases import ObjectOutcomes
from reach.evaluation.table import Evaluation

BINS = 10
FEWEST_IN_BIN = 10
"""Trials a dot of the calibration plot stands for, at least; a quarter of all if that is less."""


def pooled(result: Evaluation) -> ObjectOutcomes:
    """All grasps as if of one object: curves cannot be averaged over objects, counts can."""
    return ObjectOutcomes(
        "all",
        np.array([case.successes for case in result.cases]),
        np.array([case.trials for case in result.cases]),
    )


SIMULATED = "simulated labels"
"""What stands on a picture that is a file of its own."""


def precision_recall_svg(result: Evaluation, name: str = "pr", *, mark: str = "") -> str:
    """Precision against recall of every row, over all trials pooled; the mark is its title."""
    everything = pooled(result)
    lowest = 1.0
    with figure((4.6, 4.3)) as (canvas, axes):
        for row in result.rows:
            if row.name == "constant":
                continue
            precision, recall, _ = metrics.precision_recall(everything, row.scores)
            recall, precision = np.append(0.0, recall), np.append(precision[0], precision)
            lowest = min(lowest, float(precision.min()))
            axes.step(
                recall,
                precision,
                where="pre",
                color=color_of(row.name),
                linestyle=dashes_of(row.name),
                linewidth=1.8 if row.name.endswith("-robust") else 1.2,
                label=row.name,
            )
        base = everything.successes.sum() / everything.trials.sum()
        axes.axhline(base, color=color_of("constant"), linewidth=1, linestyle=":")
        axes.annotate(
            "constant 1", (0.02, base), xytext=(0, 3), textcoords="offset points", fontsize=8
        )
        floor = np.floor(20 * lowest - 0.5) / 20  # no curve goes there: the space is for the others
        axes.set(xlim=(0, 1.01), ylim=(max(0.0, floor), 1.01), xlabel="recall", ylabel="precision")
        axes.set_title(mark)
        canvas.legend(loc="outside lower center", fontsize=8, ncols=3)
        return to_svg(canvas, name)


def reliability_bins(
    outcomes: ObjectOutcomes, scores: FloatArray, bins: int = BINS
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Mean score, success rate and number of trials in each bin of the score that has any."""
    index = np.minimum((scores * bins).astype(int), bins - 1)
    trials = np.bincount(index, outcomes.trials, bins)
    hits = np.bincount(index, outcomes.successes, bins)
    weighted = np.bincount(index, scores * outcomes.trials, bins)
    some = trials > 0
    mean, rate = weighted[some] / trials[some], hits[some] / trials[some]
    return mean, rate, trials[some].astype(float)


def reliability_svg(result: Evaluation, name: str = "calibration", *, mark: str = "") -> str:
    """Success rate against score: a calibrated model lies on the diagonal; the mark is its title."""
    everything = pooled(result)
    with figure((4.6, 4.3)) as (canvas, axes):
        axes.plot([0, 1], [0, 1], color=color_of("oracle"), linewidth=0.8, linestyle=":")
        largest = everything.trials.sum()
        bins = int(np.clip(largest // (2 * FEWEST_IN_BIN), 2, BINS))
        for row in result.rows:
            if row.name in ("constant", "oracle"):
                continue
            score, rate, trials = reliability_bins(everything, row.scores, bins)
            enough = trials >= min(FEWEST_IN_BIN, largest / 4)
            score, rate, trials = score[enough], rate[enough], trials[enough]
            color = color_of(row.name)
            graded = len(score) > 2  # a yes or no model has two points and no curve
            faint = 1.0 if graded else 0.45
            if graded:
                axes.plot(score, rate, color=color, linewidth=1.2, linestyle=dashes_of(row.name))
            axes.scatter(score, rate, s=8 + 130 * trials / largest, color=color, alpha=faint, lw=0)
        axes.set(
            xlim=(-0.03, 1.03), ylim=(-0.03, 1.03), xlabel="score", ylabel="share of trials lifted"
        )
        axes.set_title(mark)
        return to_svg(canvas, name)
