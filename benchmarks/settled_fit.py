"""Fitting the grade of `settled-robust`, and judging it on parts that it was not fitted on."""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy.optimize import minimize
from scipy.special import betaln, expit
from settled_trials import YUMI

from reach.evaluation.cases import GraspCase, Outcomes
from reach.evaluation.table import mean_metrics
from reach.models.settled import Settled
from reach.models.settled_grade import LEAST, Grade, quantities

BINS = np.linspace(0.0, 1.0, 11)
RIDGE = 1e-4
"""Keeps numbers finite that the data do not determine."""

Known = tuple[list[GraspCase], list[Settled]]
"""Labeled grasps and their settled samples."""


def fit_grade(cases: list[GraspCase], samples: list[Settled]) -> Grade:
    """Maximum likelihood of the grasps' numbers of successes, every part counting the same."""
    names = [case.object_name for case in cases]
    X = np.array([quantities(YUMI, settled) for settled in samples])
    won = np.array([case.successes for case in cases])
    lost = np.array([case.trials for case in cases]) - won
    weights = np.array([1.0 / names.count(name) for name in names])

    def loss(b: np.ndarray) -> float:
        mean, alike = np.clip(expit(X @ b[:-1]), LEAST, 1 - LEAST), np.exp(b[-1])
        p, q = alike * mean, alike * (1.0 - mean)
        likelihood = betaln(won + p, lost + q) - betaln(p, q)
        return float(-np.average(likelihood, weights=weights) + RIDGE * b @ b)

    best = minimize(loss, np.zeros(X.shape[1] + 1), method="BFGS").x
    return Grade(*np.round(best[:-1], 2), alike=float(np.round(np.exp(best[-1]), 1)))


def cross_fitted(known: dict[str, Known]) -> tuple[dict[str, str], dict[str, np.ndarray]]:
    """Scores of each half of the parts by a grade fitted on the other half.

    Args:
        known: what is known under each pose error; all of it is fitted together.

    Returns:
        The two grades, and the scores under each pose error.
    """
    names = list(dict.fromkeys(c.object_name for cases, _ in known.values() for c in cases))
    scores = {error: np.zeros(len(cases)) for error, (cases, _) in known.items()}
    fitted = {}
    for half in (0, 1):
        left_out = {*names[half::2]}
        inside = [
            (case, settled)
            for cases, samples in known.values()
            for case, settled in zip(cases, samples, strict=True)
            if case.object_name not in left_out
        ]
        grade = fit_grade([case for case, _ in inside], [settled for _, settled in inside])
        fitted[f"without half {half}"] = grade.version
        for error, (cases, samples) in known.items():
            for i, case in enumerate(cases):
                if case.object_name in left_out:
                    scores[error][i] = grade.rate(YUMI, samples[i])
    return fitted, scores


def judged(cases: list[GraspCase], scores: np.ndarray) -> dict[str, Any]:
    """Means over parts, and the reliability diagram."""
    return {
        **mean_metrics(Outcomes.of(cases), scores),
        "reliability diagram": reliability_diagram(cases, scores),
    }


def reliability_diagram(cases: list[GraspCase], scores: np.ndarray) -> list[list[float]]:
    """Mean score, mean success rate and number of grasps in each tenth of the scores."""
    rates = np.array([case.rate for case in cases])
    bins = np.clip(np.digitize(scores, BINS) - 1, 0, len(BINS) - 2)
    return [
        [float(scores[bins == b].mean()), float(rates[bins == b].mean()), int((bins == b).sum())]
        for b in np.unique(bins)
    ]
