"""A pressed pad's preload wrench, and its friction as points on a grid of cells.

As in [elements][reach.kernels.elements], but with the pressure of an elastic foundation, p =
k_w delta, and with one friction point a group (a cell of the patch's box and a class of normals):
a settling part asks for these dozens of times.
"""

from __future__ import annotations

import numpy as np

from reach.arrays import FloatArray, IntArray
from reach.kernels.clipping import CORNERS, cut
from reach.kernels.compiling import compiled
from reach.kernels.moments import CLASSES, normal_class

CELLS = 4
"""Cells along each side of the patch's box: a square's torsion is 2 % below the exact value."""
GROUPS = CELLS * CELLS * CLASSES
SUMS = 10
"""Columns: integral of p 0, of p r 1-3, of p n n' (xx, yy, zz, xy, xz, yz) 4-9."""
SMALL = 0.5
"""Triangles smaller than this share of a cell go uncut to the cell of their barycenter."""


@compiled
def _add(
    polygon: FloatArray,
    corners: int,
    n: FloatArray,
    high: float,
    stiffness: float,
    sums: FloatArray,
    group: int,
    wrench: FloatArray,
) -> float:
    """Add a polygon under p = stiffness (high - z) to a group and to the patch's wrench.

    Returns:
        The polygon's area.
    """
    total = 0.0
    for k in range(1, corners - 1):
        ax, ay, az = polygon[0, 0], polygon[0, 1], polygon[0, 2]
        bx, by, bz = polygon[k, 0], polygon[k, 1], polygon[k, 2]
        cx, cy, cz = polygon[k + 1, 0], polygon[k + 1, 1], polygon[k + 1, 2]
        ux, uy, uz, vx, vy, vz = bx - ax, by - ay, bz - az, cx - ax, cy - ay, cz - az
        ex, ey, ez = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
        area = 0.5 * np.sqrt(ex * ex + ey * ey + ez * ez)
        pa, pb, pc = stiffness * (high - az), stiffness * (high - bz), stiffness * (high - cz)
        p = pa + pb + pc
        force, first = area * p / 3.0, area / 12.0
        mx = first * (p * (ax + bx + cx) + pa * ax + pb * bx + pc * cx)
        my = first * (p * (ay + by + cy) + pa * ay + pb * by + pc * cy)
        mz = first * (p * (az + bz + cz) + pa * az + pb * bz + pc * cz)
        nx, ny, nz = n[0], n[1], n[2]
        sums[group, 0] += force
        sums[group, 1] += mx
        sums[group, 2] += my
        sums[group, 3] += mz
        sums[group, 4] += force * nx * nx
        sums[group, 5] += force * ny * ny
        sums[group, 6] += force * nz * nz
        sums[group, 7] += force * nx * ny
        sums[group, 8] += force * nx * nz
        sums[group, 9] += force * ny * nz
        wrench[0] += force * nx
        wrench[1] += force * ny
        wrench[2] += force * nz
        wrench[3] += my * nz - mz * ny
        wrench[4] += mz * nx - mx * nz
        wrench[5] += mx * ny - my * nx
        total += area
    return total


@compiled
def _copy(corners: FloatArray, count: int, target: FloatArray) -> None:
    for k in range(count):
        for i in range(3):
            target[k, i] = corners[k, i]


@compiled
def _cell(value: float, low: float, size: float) -> int:
    return min(CELLS - 1, max(0, int((value - low) / size)))


@compiled
def add_layer(
    count: int,
    triangles: FloatArray,
    normals: FloatArray,
    high: float,
    stiffness: float,
    sums: FloatArray,
    used: IntArray,
    rows: int,
    wrench: FloatArray,
) -> tuple[int, float]:
    """Add the pressure of one elastic layer pressed to a depth.

    Args:
        count: number of pieces.
        triangles: pieces over the pad, pad frame, shape (>= count, 3, 3).
        normals: inward, pad frame, shape (>= count, 3).
        high: depth at which the pressure vanishes [m].
        stiffness: of the layer [N/m^3].
        sums: shape (GROUPS, SUMS), rows not listed in `used` are zero.
        used: rows in use, shape (GROUPS,).
        rows: how many.
        wrench: normal force and torque about the pad's origin, pad frame, shape (6,); added to.

    Returns:
        Number of rows in use, and the pressed surface's area [m^2].
    """
    low_x, high_x, low_y, high_y = np.inf, -np.inf, np.inf, -np.inf
    for t in range(count):
        for i in range(3):
            # Where an edge dives below the depth the cut lies between its ends: a little more.
            if triangles[t, i, 2] < high:
                for j in range(3):
                    s = 1.0
                    if triangles[t, j, 2] > high:
                        s = (high - triangles[t, i, 2]) / (triangles[t, j, 2] - triangles[t, i, 2])
                    x = triangles[t, i, 0] + s * (triangles[t, j, 0] - triangles[t, i, 0])
                    y = triangles[t, i, 1] + s * (triangles[t, j, 1] - triangles[t, i, 1])
                    low_x, high_x = min(low_x, x), max(high_x, x)
                    low_y, high_y = min(low_y, y), max(high_y, y)
    if low_x > high_x:
        return rows, 0.0
    size_x = max((high_x - low_x) / CELLS, 1e-9)
    size_y = max((high_y - low_y) / CELLS, 1e-9)
    whole, strip = np.empty((16, 3)), np.empty((16, 3))
    cell, spare = np.empty((16, 3)), np.empty((16, 4))
    area = 0.0
    for t in range(count):
        corners = CORNERS
        least = min(triangles[t, 0, 2], triangles[t, 1, 2], triangles[t, 2, 2])
        most = max(triangles[t, 0, 2], triangles[t, 1, 2], triangles[t, 2, 2])
        if least >= high:
            continue
        _copy(triangles[t], CORNERS, whole)
        if most > high:
            corners = cut(whole, CORNERS, 0.0, 0.0, 1.0, high, spare)
            if corners == 0:
                continue
        n = normals[t]
        kind = normal_class(n[0], n[1], n[2])
        x0, x1, y0, y1, sx, sy = np.inf, -np.inf, np.inf, -np.inf, 0.0, 0.0
        for i in range(corners):
            x, y = whole[i, 0], whole[i, 1]
            x0, x1, y0, y1 = min(x0, x), max(x1, x), min(y0, y), max(y1, y)
            sx, sy = sx + x, sy + y
        if x1 - x0 <= SMALL * size_x and y1 - y0 <= SMALL * size_y:
            ix0 = ix1 = _cell(sx / corners, low_x, size_x)
            iy0 = iy1 = _cell(sy / corners, low_y, size_y)
        else:
            ix0, ix1 = _cell(x0, low_x, size_x), _cell(x1, low_x, size_x)
            iy0, iy1 = _cell(y0, low_y, size_y), _cell(y1, low_y, size_y)
        for ix in range(ix0, ix1 + 1):
            inside = corners
            _copy(whole, corners, strip)
            if ix > ix0:
                inside = cut(strip, inside, -1.0, 0.0, 0.0, -(low_x + ix * size_x), spare)
            if ix < ix1:
                inside = cut(strip, inside, 1.0, 0.0, 0.0, low_x + (ix + 1) * size_x, spare)
            for iy in range(iy0, iy1 + 1):
                left = inside
                _copy(strip, left, cell)
                if iy > iy0:
                    left = cut(cell, left, 0.0, -1.0, 0.0, -(low_y + iy * size_y), spare)
                if iy < iy1:
                    left = cut(cell, left, 0.0, 1.0, 0.0, low_y + (iy + 1) * size_y, spare)
                if left < 3:
                    continue
                group = (ix * CELLS + iy) * CLASSES + kind
                fresh = sums[group, 0] == 0.0
                area += _add(cell, left, n, high, stiffness, sums, group, wrench)
                if fresh and sums[group, 0] > 0.0:
                    used[rows] = group
                    rows += 1
    return rows, area


@compiled
def friction_points_of(
    rows: int,
    used: IntArray,
    sums: FloatArray,
    friction: float,
    T: FloatArray,
    length: float,
    points: FloatArray,
    first: int,
) -> int:
    """Write one friction point a group, and set the groups back to zero.

    Args:
        rows: number of groups.
        used: their rows.
        sums: shape (GROUPS, SUMS).
        friction: coefficient mu.
        T: pose of the pad in the frame of the wrenches, shape (4, 4).
        length: torque scale [m].
        points: receives columns from `first` on, shape (POINT, P).
        first: where to write.

    Returns:
        Column after the last one written.
    """
    for row in range(rows):
        m = sums[used[row]]
        force = m[0]
        x, y, z = m[1] / force, m[2] / force, m[3] / force
        for i in range(3):
            points[i, first] = (T[i, 0] * x + T[i, 1] * y + T[i, 2] * z + T[i, 3]) / length
            points[9 + i, first] = 0.0
        for entry in range(6):
            i, j = (entry, entry) if entry < 3 else (0 if entry < 5 else 1, 1 if entry == 3 else 2)
            turned = (
                T[i, 0] * (m[4] * T[j, 0] + m[7] * T[j, 1] + m[8] * T[j, 2])
                + T[i, 1] * (m[7] * T[j, 0] + m[5] * T[j, 1] + m[9] * T[j, 2])
                + T[i, 2] * (m[8] * T[j, 0] + m[9] * T[j, 1] + m[6] * T[j, 2])
            )
            points[3 + entry, first] = (1.0 if entry < 3 else 0.0) - turned / force
        points[12, first] = friction * force
        first += 1
        for column in range(SUMS):
            m[column] = 0.0
    return first
