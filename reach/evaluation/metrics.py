"""Ranking and calibration of grasp scores, per object, as in [Danielczuk2019] Sect. 5.

One sample is one trial's label; the score is the grasp's, so that a grasp tried five times is
five samples with one score. Every function takes weights of shape (B, G), how often each grasp
counts in each of B resamplings, and answers B values at once; without weights it answers one.

Sources:
    [Danielczuk2019] Danielczuk et al., REACH: Reducing False Negatives in Robot Grasp Planning
    with a Robust Efficient Area Contact Hypothesis Model, ISRR 2019.
"""

from __future__ import annotations

import numpy as np

from reach.arrays import FloatArray
from reach.evaluation.cases import ObjectOutcomes

RECALL_THRESHOLDS: FloatArray = np.linspace(0.0, 1.0, 11)
"""Thresholds of the average recall: 0, 0.1, ..., 1."""

_ROUNDING = 1e-9  # 3 * 0.1 is above 0.3 by one bit; a share of 0.3 must pass the threshold 0.3


def _weighted(
    outcomes: ObjectOutcomes, weights: FloatArray | None
) -> tuple[FloatArray, FloatArray]:
    """Numbers of successes and of trials each grasp stands for, both shape (B, G)."""
    if weights is None:
        weights = np.ones((1, len(outcomes.trials)))
    return weights * outcomes.successes, weights * outcomes.trials


def average_precision(
    outcomes: ObjectOutcomes, scores: FloatArray, weights: FloatArray | None = None
) -> FloatArray:
    """Area under the precision-recall steps, grasps of equal score entering together.

    AP = sum_k (R_k - R_{k-1}) P_k over the distinct scores in falling order, without
    interpolation (scikit-learn's `average_precision_score`).

    Args:
        outcomes: of one object's G grasps.
        scores: shape (G,).
        weights: shape (B, G); every grasp once if None.

    Returns:
        Shape (B,); NaN where no sample is positive.
    """
    positive, total = _weighted(outcomes, weights)
    order = np.argsort(-scores, kind="stable")
    hits = np.cumsum(positive[:, order], axis=1)
    predicted = np.cumsum(total[:, order], axis=1)
    last_of_tie = np.append(np.diff(scores[order]) != 0, True)
    hits, predicted = hits[:, last_of_tie], predicted[:, last_of_tie]
    precision = np.divide(hits, predicted, out=np.zeros_like(hits), where=predicted > 0)
    gained = np.diff(hits, axis=1, prepend=0.0)
    return ratio((gained * precision).sum(axis=1), hits[:, -1])


def average_recall(
    outcomes: ObjectOutcomes, scores: FloatArray, weights: FloatArray | None = None
) -> FloatArray:
    """Recall averaged over the thresholds 0, 0.1, ..., 1; predicted when score >= threshold.

    Returns:
        Shape (B,); NaN where no sample is positive. A constant score of 1 has recall 1.
    """
    positive, _ = _weighted(outcomes, weights)
    share = (scores[:, None] >= RECALL_THRESHOLDS - _ROUNDING).mean(axis=1)
    return ratio(positive @ share, positive.sum(axis=1))


def mean_absolute_error(
    outcomes: ObjectOutcomes, scores: FloatArray, weights: FloatArray | None = None
) -> FloatArray:
    """Mean distance of the score to the grasp's success rate; every grasp counts the same.

    Returns:
        Shape (B,).
    """
    if weights is None:
        weights = np.ones((1, len(scores)))
    return ratio(weights @ np.abs(scores - outcomes.rates), weights.sum(axis=1))


def brier(
    outcomes: ObjectOutcomes, scores: FloatArray, weights: FloatArray | None = None
) -> FloatArray:
    """Mean squared distance of the score to each trial's label (0 or 1).

    Returns:
        Shape (B,). The oracle's value is the labels' own scatter, not zero.
    """
    positive, total = _weighted(outcomes, weights)
    squares = positive @ (scores - 1.0) ** 2 + (total - positive) @ scores**2
    return ratio(squares, total.sum(axis=1))


def f1(precision: FloatArray, recall: FloatArray) -> FloatArray:
    """Harmonic mean of average precision and average recall."""
    return ratio(2.0 * precision * recall, precision + recall)


def precision_recall(
    outcomes: ObjectOutcomes, scores: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Precision, recall and threshold at each distinct score, falling; each shape (K,)."""
    order = np.argsort(-scores, kind="stable")
    hits = np.cumsum(outcomes.successes[order])
    predicted = np.cumsum(outcomes.trials[order])
    last_of_tie = np.append(np.diff(scores[order]) != 0, True)
    hits, predicted = hits[last_of_tie], predicted[last_of_tie]
    return hits / predicted, hits / max(hits[-1], 1), scores[order][last_of_tie]


def ratio(numerator: FloatArray, denominator: FloatArray) -> FloatArray:
    """Quotient, NaN where the denominator is zero."""
    result: FloatArray = np.divide(
        numerator,
        denominator,
        out=np.full(np.shape(numerator), np.nan),
        where=np.asarray(denominator) > 0,
    )
    return result
