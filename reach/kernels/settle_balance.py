"""What friction cannot balance: the nearest point of preload plus friction to zero.

Friction can add to the preload wrench W any element of a convex set E, known by its support
function. The residual is the point of W + E nearest to zero, seen only along the motions that
the part is free to make: its direction is the motion that gains most over friction, and its
length is by how much. Found by Wolfe's iteration ([Wolfe1976]), as in
[min_norm][reach.kernels.min_norm].
"""

from __future__ import annotations

import numpy as np

from reach.arrays import FloatArray
from reach.kernels.compiling import compiled
from reach.kernels.min_norm import MOST_POINTS, nearest_in_hull
from reach.kernels.support import friction_support

MOST_ITERATIONS = 60
GAP = 0.02
"""The residual's length is known to this part of itself, or of what counts as balanced."""


@compiled
def residual(
    wrench: FloatArray,
    points: FloatArray,
    count: int,
    motions: FloatArray,
    balanced: float,
    result: FloatArray,
) -> float:
    """Find the residual wrench along the motions that are free.

    Args:
        wrench: preload W, and weight if any, torques scaled, shape (6,).
        points: friction points, shape (POINT, P).
        count: how many.
        motions: unit twists that the part may make, as the wrenches see them, shape (M, 6).
        balanced: lengths below this are of no interest [N].
        result: receives the residual along each motion, shape (M,).

    Returns:
        Its length [N]: exact to GAP of itself, or anything up to `balanced`.
    """
    free = len(motions)
    hull = np.zeros((MOST_POINTS + 1, 6))
    convex, weights = np.empty(MOST_POINTS + 1), np.empty(MOST_POINTS + 1)
    gram = np.empty((MOST_POINTS + 1, MOST_POINTS + 1))
    target, x, d, new = np.zeros(6), np.zeros(6), np.empty(6), np.empty(6)
    for m in range(free):
        for i in range(6):
            target[m] -= motions[m, i] * wrench[i]
    convex[0] = 1.0
    size = 1  # no friction at all belongs to E: start from zero
    for _ in range(MOST_ITERATIONS):
        length = 0.0
        for m in range(free):
            x[m] = -target[m]
            for k in range(size):
                x[m] += convex[k] * hull[k, m]
            length += x[m] * x[m]
            result[m] = x[m]
        length = float(np.sqrt(length))
        if length <= balanced:
            return length
        for i in range(6):
            d[i] = 0.0
            for m in range(free):
                d[i] -= motions[m, i] * x[m] / length
            new[i] = 0.0
        friction_support(points, 0, count, d, new)
        # Every element of W + E lies at least `bound` along the residual.
        bound = 0.0
        for m in range(free):
            value = 0.0
            for i in range(6):
                value += motions[m, i] * new[i]
            hull[size, m] = value
            bound += (value - target[m]) * x[m] / length
        if length - bound <= GAP * length:
            return length
        convex[size] = 0.0
        size = nearest_in_hull(hull, convex, size + 1, target, gram, weights)
    return length
