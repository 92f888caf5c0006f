"""A patch as one exact normal wrench and few friction points, however finely the mesh is cut.

In the limit of infinitely small triangles, the limit surface of a patch under pressure p has the
support function

    h(v, w) = integral of p (n . u) + mu p |u - n (n . u)| dA,   u(r) = v + w x r,

for the twist (v, w) ([Goyal1991], the maximal-dissipation form of Eq. 4.1). The first term is
linear in the twist: one exact wrench a patch. The second is a sum over groups of surface (one grid
cell, one class of normals); each group becomes four points that carry its exact pressure force,
center of pressure and second moments, and share the second moments of its normals.

A friction point, one column of a (POINT, P) array, stands for

    h(v, w) = f sqrt(u' M u + (b . w)^2),   u = v + w x c,

which also describes a triangle's ellipsoid (b = normal times tau_max / f_t,max), a soft point and
an ellipse: every contact model hands such columns to the same solver.
"""

from __future__ import annotations

import numpy as np

from reach.arrays import FloatArray
from reach.kernels.compiling import compiled, compiled_in_place, plain

POINT = 13
"""Rows: c 0-2, M (xx, yy, zz, xy, xz, yz) 3-8, b 9-11, f 12; lengths over the torque scale."""
START = plain(0)
"""First column."""


@compiled_in_place
def _rotated_form(T: FloatArray, i: int, j: int, m: FloatArray, group: int) -> float:
    """Entry i, j of R N R', N the second moments of the normals in columns 13-18."""
    x = T[j, 0] * m[group, 13] + T[j, 1] * m[group, 16] + T[j, 2] * m[group, 17]
    y = T[j, 0] * m[group, 16] + T[j, 1] * m[group, 14] + T[j, 2] * m[group, 18]
    z = T[j, 0] * m[group, 17] + T[j, 1] * m[group, 18] + T[j, 2] * m[group, 15]
    return float(T[i, 0] * x + T[i, 1] * y + T[i, 2] * z)


@compiled
def friction_points(
    m: FloatArray,
    group: int,
    scale: float,
    T: FloatArray,
    length: float,
    points: FloatArray,
    first: int,
) -> int:
    """Turn one group's moments into four friction points.

    Args:
        m: moments, pad frame, unit stiffness, shape (GROUPS, MOMENTS).
        group: row of `m`.
        scale: friction times stiffness k.
        T: pose of the pad in the frame of the wrenches, shape (4, 4).
        length: torque scale [m].
        points: receives columns from `first` on, shape (POINT, P).
        first: where to write.

    Returns:
        Column after the last one written.
    """
    force = m[group, 0]
    cx, cy, cz = m[group, 1] / force, m[group, 2] / force, m[group, 3] / force
    nx, ny, nz = m[group, 10], m[group, 11], m[group, 12]
    norm = np.sqrt(nx * nx + ny * ny + nz * nz)
    nx, ny, nz = nx / norm, ny / norm, nz / norm
    xx, yy, zz = (
        m[group, 4] / force - cx * cx,
        m[group, 5] / force - cy * cy,
        m[group, 6] / force - cz * cz,
    )
    xy, xz, yz = (
        m[group, 7] / force - cx * cy,
        m[group, 8] / force - cx * cz,
        m[group, 9] / force - cy * cz,
    )
    # Tangents: the pad's x and y turned by the smallest rotation that takes z to the normal.
    turn = 1.0 / (1.0 + nz)
    px, py, pz = 1.0 - turn * nx * nx, -turn * nx * ny, -nx
    sx, sy, sz = py, 1.0 - turn * ny * ny, -ny
    gx, gy, gz = (
        xx * px + xy * py + xz * pz,
        xy * px + yy * py + yz * pz,
        xz * px + yz * py + zz * pz,
    )
    v11 = max(0.0, px * gx + py * gy + pz * gz)
    v12 = sx * gx + sy * gy + sz * gz
    v22 = (
        xx * sx * sx
        + yy * sy * sy
        + zz * sz * sz
        + 2.0 * (xy * sx * sy + xz * sx * sz + yz * sy * sz)
    )
    # Four points c +- sqrt(2) (columns of the Cholesky factor) carry the same second moments.
    l11 = np.sqrt(2.0 * v11)
    l21 = 2.0 * v12 / l11 if l11 > 1e-12 else 0.0
    l22 = np.sqrt(max(0.0, 2.0 * v22 - l21 * l21))
    share = 0.25 * scale * force
    m_xx = 1.0 - _rotated_form(T, 0, 0, m, group) / force
    m_yy = 1.0 - _rotated_form(T, 1, 1, m, group) / force
    m_zz = 1.0 - _rotated_form(T, 2, 2, m, group) / force
    m_xy = -_rotated_form(T, 0, 1, m, group) / force
    m_xz = -_rotated_form(T, 0, 2, m, group) / force
    m_yz = -_rotated_form(T, 1, 2, m, group) / force
    per_length = 1.0 / length
    for k in range(4):
        sign = 1.0 if k % 2 == 0 else -1.0
        along, across = (sign * l11, sign * l21) if k < 2 else (0.0, sign * l22)
        x = cx + along * px + across * sx
        y = cy + along * py + across * sy
        z = cz + along * pz + across * sz
        column = first + k
        for i in range(3):
            points[i, column] = (T[i, 0] * x + T[i, 1] * y + T[i, 2] * z + T[i, 3]) * per_length
            points[9 + i, column] = 0.0
        points[3, column], points[4, column], points[5, column] = m_xx, m_yy, m_zz
        points[6, column], points[7, column], points[8, column] = m_xy, m_xz, m_yz
        points[12, column] = share
    return first + 4


@compiled
def wrench_in_frame(
    fx: float,
    fy: float,
    fz: float,
    tx: float,
    ty: float,
    tz: float,
    T: FloatArray,
    length: float,
    wrench: FloatArray,
) -> None:
    """Express a force and a torque of the pad's frame in the frame of the wrenches, torque scaled."""
    for i in range(3):
        wrench[i] = T[i, 0] * fx + T[i, 1] * fy + T[i, 2] * fz
        wrench[3 + i] = T[i, 0] * tx + T[i, 1] * ty + T[i, 2] * tz
    wrench[3] = (wrench[3] + T[1, 3] * wrench[2] - T[2, 3] * wrench[1]) / length
    wrench[4] = (wrench[4] + T[2, 3] * wrench[0] - T[0, 3] * wrench[2]) / length
    wrench[5] = (wrench[5] + T[0, 3] * wrench[1] - T[1, 3] * wrench[0]) / length
