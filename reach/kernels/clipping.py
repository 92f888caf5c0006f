"""Clipping of a convex polygon in space by a half-space (Sutherland and Hodgman)."""

from __future__ import annotations

from reach.arrays import FloatArray
from reach.kernels.compiling import compiled


@compiled
def clip(
    source: FloatArray,
    count: int,
    ax: float,
    ay: float,
    az: float,
    limit: float,
    target: FloatArray,
) -> int:
    """Keep the part of a polygon where ax x + ay y + az z <= limit.

    Args:
        source: corners, shape (>= count, 3).
        count: number of corners.
        ax: normal of the cutting plane, x.
        ay: normal, y.
        az: normal, z.
        limit: offset of the plane along the normal.
        target: receives the corners, shape (>= count + 1, 3); must not be `source`.

    Returns:
        Number of corners in `target`, 0 if nothing is left.
    """
    kept = 0
    if count == 0:
        return 0
    previous = count - 1
    d0 = ax * source[previous, 0] + ay * source[previous, 1] + az * source[previous, 2] - limit
    for i in range(count):
        d1 = ax * source[i, 0] + ay * source[i, 1] + az * source[i, 2] - limit
        if (d0 <= 0.0) != (d1 <= 0.0):
            s = d0 / (d0 - d1)
            for axis in range(3):
                start = source[previous, axis]
                target[kept, axis] = start + s * (source[i, axis] - start)
            kept += 1
        if d1 <= 0.0:
            for axis in range(3):
                target[kept, axis] = source[i, axis]
            kept += 1
        previous, d0 = i, d1
    return kept if kept >= 3 else 0
