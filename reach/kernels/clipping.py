"""Clipping of a convex polygon in space by a half-space (Sutherland and Hodgman)."""

from __future__ import annotations

from reach.arrays import FloatArray
from reach.kernels.compiling import compiled, plain

CORNERS = plain(3)
"""Of a triangle."""


@compiled
def cut(
    polygon: FloatArray,
    count: int,
    ax: float,
    ay: float,
    az: float,
    limit: float,
    spare: FloatArray,
) -> int:
    """Keep the part of a polygon where ax x + ay y + az z <= limit, in place.

    Args:
        polygon: corners, shape (>= count + 1, 3).
        count: number of corners.
        ax: normal of the cutting plane, x.
        ay: normal, y.
        az: normal, z.
        limit: offset of the plane along the normal.
        spare: scratch, shape (>= count + 1, 4).

    Returns:
        Number of corners left, 0 if nothing is.
    """
    beyond = 0
    for i in range(count):
        spare[i, 3] = ax * polygon[i, 0] + ay * polygon[i, 1] + az * polygon[i, 2] - limit
        if spare[i, 3] > 0.0:
            beyond += 1
    if beyond == 0 or beyond == count:
        return 0 if beyond else count
    kept, previous = 0, count - 1
    for i in range(count):
        d0, d1 = spare[previous, 3], spare[i, 3]
        if (d0 <= 0.0) != (d1 <= 0.0):
            s = d0 / (d0 - d1)
            for axis in range(3):
                start = polygon[previous, axis]
                spare[kept, axis] = start + s * (polygon[i, axis] - start)
            kept += 1
        if d1 <= 0.0:
            for axis in range(3):
                spare[kept, axis] = polygon[i, axis]
            kept += 1
        previous = i
    for i in range(kept):
        for axis in range(3):
            polygon[i, axis] = spare[i, axis]
    return kept if kept >= 3 else 0
