"""Exact pressure moments of a patch, summed over a grid of cells and classes of normals.

The grid is laid over the patch's own bounding box and triangles are cut along its lines; the
classes divide the directions a surface can face. Both are properties of the surface, so that the
sums do not depend on how finely the mesh is cut.
"""

from __future__ import annotations

import numpy as np

from reach.arrays import FloatArray, IntArray
from reach.kernels.clipping import cut
from reach.kernels.compiling import compiled

CELLS = 3
"""Cells along each side of the patch's bounding box."""
TILT_STEPS = (0.9744, 0.7986, 0.4695)
"""Cosines of 13, 37 and 62 degrees: classes of tilt against the closing direction. Angles that
parts have by design, such as 0, 30, 45, 60 and 90 degrees, lie well inside a class."""
SECTORS = 8
TAN_HALF_SECTOR = 0.41421356237309503
SMALL = 0.5
"""Triangles smaller than this share of a cell go uncut to the cell of their barycenter: each group
keeps its exact force, center and second moments, so that only the grouping changes."""
CLASSES = 1 + len(TILT_STEPS) * SECTORS
GROUPS = CELLS * CELLS * CLASSES
MOMENTS = 23
"""Columns: integrals of q 0, q r 1-3, q r r' (xx, yy, zz, xy, xz, yz) 4-9, q n 10-12,
q n n' 13-18, q r x n 19-21, and the area 22."""


@compiled
def normal_class(nx: float, ny: float, nz: float) -> int:
    """Class of an inward normal in the pad's frame: nearly flat, or tilt and azimuth."""
    if nz >= TILT_STEPS[0]:
        return 0
    ring = 0
    if nz < TILT_STEPS[1]:
        ring = 1
    if nz < TILT_STEPS[2]:
        ring = 2
    return 1 + ring * SECTORS + sector(nx, ny)


@compiled
def sector(x: float, y: float) -> int:
    """Which of eight sectors of 45 degrees, centered on the axes and diagonals, holds a direction."""
    u, v = abs(x), abs(y)
    if v <= TAN_HALF_SECTOR * u:
        return 0 if x >= 0.0 else 4
    if u <= TAN_HALF_SECTOR * v:
        return 2 if y >= 0.0 else 6
    if x >= 0.0:
        return 1 if y >= 0.0 else 7
    return 3 if y >= 0.0 else 5


@compiled
def add_moments(
    polygon: FloatArray,
    i: int,
    j: int,
    k: int,
    nx: float,
    ny: float,
    nz: float,
    high: float,
    sums: FloatArray,
    group: int,
) -> None:
    """Add the moments of one triangle under q = (high - z) nz, exactly.

    The integrals are those of barycentric monomials up to degree three.

    Args:
        polygon: points, pad frame, shape (>= 3, 3).
        i: index of the first corner.
        j: index of the second corner.
        k: index of the third corner.
        nx: inward unit normal, pad frame, x.
        ny: normal, y.
        nz: normal, z.
        high: depth d_con + d_def at which the pressure vanishes [m].
        sums: shape (GROUPS, MOMENTS).
        group: row to add to.
    """
    ax, ay, az = polygon[i, 0], polygon[i, 1], polygon[i, 2]
    bx, by, bz = polygon[j, 0], polygon[j, 1], polygon[j, 2]
    cx, cy, cz = polygon[k, 0], polygon[k, 1], polygon[k, 2]
    ux, uy, uz, vx, vy, vz = bx - ax, by - ay, bz - az, cx - ax, cy - ay, cz - az
    ex, ey, ez = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
    area = 0.5 * np.sqrt(ex * ex + ey * ey + ez * ez)
    qa, qb, qc = (high - az) * nz, (high - bz) * nz, (high - cz) * nz
    q = qa + qb + qc
    force = area * q / 3.0
    sx, sy, sz = ax + bx + cx, ay + by + cy, az + bz + cz
    wx, wy, wz = (
        qa * ax + qb * bx + qc * cx,
        qa * ay + qb * by + qc * cy,
        qa * az + qb * bz + qc * cz,
    )
    first = area / 12.0
    mx, my, mz = first * (q * sx + wx), first * (q * sy + wy), first * (q * sz + wz)
    sums[group, 0] += force
    sums[group, 1] += mx
    sums[group, 2] += my
    sums[group, 3] += mz
    second = area / 60.0
    sums[group, 4] += second * (
        q * (sx * sx + ax * ax + bx * bx + cx * cx)
        + 2.0 * (wx * sx + qa * ax * ax + qb * bx * bx + qc * cx * cx)
    )
    sums[group, 5] += second * (
        q * (sy * sy + ay * ay + by * by + cy * cy)
        + 2.0 * (wy * sy + qa * ay * ay + qb * by * by + qc * cy * cy)
    )
    sums[group, 6] += second * (
        q * (sz * sz + az * az + bz * bz + cz * cz)
        + 2.0 * (wz * sz + qa * az * az + qb * bz * bz + qc * cz * cz)
    )
    sums[group, 7] += second * (
        q * (sx * sy + ax * ay + bx * by + cx * cy)
        + (wx * sy + sx * wy)
        + 2.0 * (qa * ax * ay + qb * bx * by + qc * cx * cy)
    )
    sums[group, 8] += second * (
        q * (sx * sz + ax * az + bx * bz + cx * cz)
        + (wx * sz + sx * wz)
        + 2.0 * (qa * ax * az + qb * bx * bz + qc * cx * cz)
    )
    sums[group, 9] += second * (
        q * (sy * sz + ay * az + by * bz + cy * cz)
        + (wy * sz + sy * wz)
        + 2.0 * (qa * ay * az + qb * by * bz + qc * cy * cz)
    )
    fx, fy, fz = force * nx, force * ny, force * nz
    sums[group, 10] += fx
    sums[group, 11] += fy
    sums[group, 12] += fz
    sums[group, 13] += fx * nx
    sums[group, 14] += fy * ny
    sums[group, 15] += fz * nz
    sums[group, 16] += fx * ny
    sums[group, 17] += fx * nz
    sums[group, 18] += fy * nz
    sums[group, 19] += my * nz - mz * ny
    sums[group, 20] += mz * nx - mx * nz
    sums[group, 21] += mx * ny - my * nx
    sums[group, 22] += area


@compiled
def _cell_of(value: float, low: float, per_length: float) -> int:
    return min(CELLS - 1, max(0, int((value - low) * per_length)))


@compiled
def _copy(source: FloatArray, count: int, target: FloatArray) -> None:
    for i in range(count):
        for axis in range(3):
            target[i, axis] = source[i, axis]


@compiled
def _between(
    polygon: FloatArray, count: int, axis: int, low: float, high: float, spare: FloatArray
) -> int:
    """Clip a polygon in place to low <= coordinate <= high along pad x (0) or y (1)."""
    ax, ay = (1.0, 0.0) if axis == 0 else (0.0, 1.0)
    if low > -np.inf:
        count = cut(polygon, count, -ax, -ay, 0.0, -low, spare)
    if high < np.inf:
        count = cut(polygon, count, ax, ay, 0.0, high, spare)
    return count


@compiled
def cell_moments(
    count: int,
    triangles: FloatArray,
    normals: FloatArray,
    high: float,
    sums: FloatArray,
    used: IntArray,
) -> int:
    """Sum a patch's pressure moments by grid cell and class of normals.

    Args:
        count: number of triangles.
        triangles: corners, pad frame, shape (>= count, 3, 3).
        normals: inward unit normals, pad frame, shape (>= count, 3).
        high: depth at which the pressure vanishes [m].
        sums: zeros, shape (GROUPS, MOMENTS); used rows are filled.
        used: receives the indices of the rows used, shape (GROUPS,).

    Returns:
        Number of rows used.
    """
    low_x, high_x, low_y, high_y = np.inf, -np.inf, np.inf, -np.inf
    for t in range(count):
        for i in range(3):
            low_x, high_x = min(low_x, triangles[t, i, 0]), max(high_x, triangles[t, i, 0])
            low_y, high_y = min(low_y, triangles[t, i, 1]), max(high_y, triangles[t, i, 1])
    size_x = max((high_x - low_x) / CELLS, 1e-9)
    size_y = max((high_y - low_y) / CELLS, 1e-9)
    per_x, per_y = 1.0 / size_x, 1.0 / size_y
    strip, cell, spare = np.empty((12, 3)), np.empty((12, 3)), np.empty((12, 4))
    rows = 0
    for t in range(count):
        nx, ny, nz = normals[t, 0], normals[t, 1], normals[t, 2]
        kind = normal_class(nx, ny, nz)
        xa, xb, xc = triangles[t, 0, 0], triangles[t, 1, 0], triangles[t, 2, 0]
        ya, yb, yc = triangles[t, 0, 1], triangles[t, 1, 1], triangles[t, 2, 1]
        x0, x1 = min(xa, xb, xc), max(xa, xb, xc)
        y0, y1 = min(ya, yb, yc), max(ya, yb, yc)
        if x1 - x0 <= SMALL * size_x and y1 - y0 <= SMALL * size_y:
            first_x = last_x = _cell_of((xa + xb + xc) / 3.0, low_x, per_x)
            first_y = last_y = _cell_of((ya + yb + yc) / 3.0, low_y, per_y)
        else:
            first_x, last_x = _cell_of(x0, low_x, per_x), _cell_of(x1, low_x, per_x)
            first_y, last_y = _cell_of(y0, low_y, per_y), _cell_of(y1, low_y, per_y)
        if first_x == last_x and first_y == last_y:
            group = (first_x * CELLS + first_y) * CLASSES + kind
            if sums[group, 22] == 0.0:
                used[rows] = group
                rows += 1
            add_moments(triangles[t], 0, 1, 2, nx, ny, nz, high, sums, group)
            if sums[group, 22] == 0.0:
                rows -= 1
            continue
        for ix in range(first_x, last_x + 1):
            n = 3
            _copy(triangles[t], n, strip)
            if first_x < last_x:
                lower = low_x + ix * size_x if ix > first_x else -np.inf
                upper = low_x + (ix + 1) * size_x if ix < last_x else np.inf
                n = _between(strip, n, 0, lower, upper, spare)
            for iy in range(first_y, last_y + 1):
                m = n
                _copy(strip, n, cell)
                if first_y < last_y:
                    lower = low_y + iy * size_y if iy > first_y else -np.inf
                    upper = low_y + (iy + 1) * size_y if iy < last_y else np.inf
                    m = _between(cell, n, 1, lower, upper, spare)
                group = (ix * CELLS + iy) * CLASSES + kind
                fresh = sums[group, 22] == 0.0
                for i in range(1, m - 1):
                    add_moments(cell, 0, i, i + 1, nx, ny, nz, high, sums, group)
                if fresh and sums[group, 22] > 0.0:
                    used[rows] = group
                    rows += 1
    return rows
