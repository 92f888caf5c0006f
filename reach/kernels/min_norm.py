"""How far a ray from the origin stays inside a convex set given by its support function.

The point of the convex hull of a few support points that is nearest to a target is found by
Wolfe's active-set iteration ([Wolfe1976]); a direction that separates the target from the set
moves the target back along its ray, as in GJK ray casting ([Bergen2004]). At the end the target is
the point where the ray leaves the set.
"""

from __future__ import annotations

import numpy as np

from reach.arrays import FloatArray, IntArray
from reach.kernels.compiling import compiled, plain
from reach.kernels.support import support

MOST_POINTS = 7
"""A point of a set in six dimensions is a combination of at most seven of its points."""

MOST_STALLS = 8
"""Steps without progress after which rounding is taken to allow no better answer."""
SMALLEST = 1e-3
"""A ray that leaves the set before this point is said to leave it at the origin; the iteration would
only approach that answer."""
FORCES, WRENCHES = plain(3), plain(6)
"""Dimensions in which a ray may leave."""


@compiled
def affine_weights(
    points: FloatArray, count: int, target: FloatArray, gram: FloatArray, weights: FloatArray
) -> bool:
    """Weights, summing to one, of the point nearest to a target in the points' affine hull.

    Returns:
        False if the points are affinely dependent.
    """
    size = 0.0
    for i in range(count):
        for j in range(i + 1):
            value = 0.0
            for k in range(6):
                value += (points[i, k] - target[k]) * (points[j, k] - target[k])
            gram[i, j] = value
        size = max(size, gram[i, i])
    size = max(size, 1e-300)
    for i in range(count):
        for j in range(i + 1):
            gram[i, j] += size  # plus a constant: regular when affinely independent
    for i in range(count):  # Cholesky in place
        for j in range(i + 1):
            value = gram[i, j]
            for k in range(j):
                value -= gram[i, k] * gram[j, k]
            if i == j:
                if value <= 1e-13 * size:
                    return False
                gram[i, i] = np.sqrt(value)
            else:
                gram[i, j] = value / gram[j, j]
    for i in range(count):
        value = 1.0
        for k in range(i):
            value -= gram[i, k] * weights[k]
        weights[i] = value / gram[i, i]
    total = 0.0
    for i in range(count - 1, -1, -1):
        value = weights[i]
        for k in range(i + 1, count):
            value -= gram[k, i] * weights[k]
        weights[i] = value / gram[i, i]
        total += weights[i]
    for i in range(count):
        weights[i] /= total
    return True


@compiled
def nearest_in_hull(
    points: FloatArray,
    convex: FloatArray,
    count: int,
    target: FloatArray,
    gram: FloatArray,
    weights: FloatArray,
) -> int:
    """Move convex weights to the hull's point nearest to a target, dropping points not needed.

    Args:
        points: shape (MOST_POINTS + 1, 6); reordered when points are dropped.
        convex: convex weights to start from, shape (MOST_POINTS + 1,); updated.
        count: number of points.
        target: shape (6,).
        gram: scratch, shape (MOST_POINTS + 1, MOST_POINTS + 1).
        weights: scratch, shape (MOST_POINTS + 1,).

    Returns:
        Number of points left.
    """
    while count > 1:
        drop = -1
        if count <= MOST_POINTS and affine_weights(points, count, target, gram, weights):
            step = 1.0
            for i in range(count):
                if weights[i] <= 1e-12 and weights[i] < convex[i]:
                    reach = convex[i] / (convex[i] - weights[i])
                    if reach < step or drop < 0:
                        step, drop = min(step, reach), i
            for i in range(count):
                convex[i] += step * (weights[i] - convex[i])
            if drop < 0:
                return count
        else:  # dependent: give up the point that carries least
            drop = 0
            for i in range(1, count):
                if convex[i] < convex[drop]:
                    drop = i
        count -= 1
        for k in range(6):
            points[drop, k] = points[count, k]
        convex[drop] = convex[count]
        total = 0.0
        for i in range(count):
            convex[i] = max(convex[i], 0.0)
            total += convex[i]
        if total <= 0.0:
            convex[0], total, count = 1.0, 1.0, 1
        for i in range(count):
            convex[i] /= total
    convex[0] = 1.0
    return 1


@compiled
def exit_of_ray(
    normals: FloatArray,
    elements: FloatArray,
    starts: IntArray,
    ray: FloatArray,
    farthest: float,
    tolerance: float,
    most_steps: int,
    dimensions: int,
) -> tuple[float, int]:
    """Largest s <= farthest with s * ray inside Lambda.

    Args:
        normals: wrench of each contact's pressure, shape (J, 6), torques scaled.
        elements: friction points, shape (POINT, P).
        starts: first point of each contact, and the end, shape (J + 1,).
        ray: wrench to apply, shape (6,), torques scaled.
        farthest: cap.
        tolerance: distance of the found point from Lambda, relative to the point's length.
        most_steps: limit on support evaluations.
        dimensions: 6, or 3 to ask for forces only, whatever torque they bring.

    Returns:
        s, and the number of support evaluations. Every value met is an upper bound: stopping
        early errs by saying too much, by less than the tolerance unless the steps ran out.
    """
    points = np.empty((MOST_POINTS + 1, 6))
    convex = np.empty(MOST_POINTS + 1)
    weights = np.empty(MOST_POINTS + 1)
    gram = np.empty((MOST_POINTS + 1, MOST_POINTS + 1))
    target, x, d = np.empty(6), np.empty(6), np.zeros(6)
    new, part = np.empty(6), np.empty(6)
    ray_length = 0.0
    for i in range(dimensions):
        ray_length += ray[i] * ray[i]
    ray_length = np.sqrt(ray_length)
    if ray_length == 0.0:
        return farthest, 0
    s, nearest, stalled = farthest, np.inf, 0
    points[0] = 0.0  # every contact may rest: the origin belongs to Lambda
    convex[0] = 1.0
    count = 1
    for step in range(most_steps):
        distance = 0.0
        for i in range(6):
            target[i] = s * ray[i] if i < dimensions else 0.0
            x[i] = -target[i]
        for k in range(count):
            for i in range(6):
                x[i] += convex[k] * points[k, i]
        for i in range(6):
            distance += x[i] * x[i]
        distance = np.sqrt(distance)
        if distance <= tolerance * s * ray_length:
            return s, step
        stalled = stalled + 1 if distance > nearest * (1.0 - 1e-9) else 0
        if stalled > MOST_STALLS:
            return s, step
        nearest = min(nearest, distance)
        along = 0.0
        for i in range(dimensions):
            d[i] = -x[i] / distance
            along += d[i] * ray[i]
        value = support(normals, elements, starts, d, new, part)
        for i in range(dimensions, 6):
            new[i] = 0.0
        if along > 0.0 and value < s * along:
            s, nearest = value / along, np.inf
            if s < SMALLEST:
                return 0.0, step
            for i in range(dimensions):
                target[i] = s * ray[i]
            if count == MOST_POINTS:  # the simplex that held the old target does not hold this one
                count = nearest_in_hull(points, convex, count, target, gram, weights)
        for i in range(6):
            points[count, i] = new[i]
        convex[count] = 0.0
        count = nearest_in_hull(points, convex, count + 1, target, gram, weights)
    return s, most_steps
