"""Support function of the set of wrenches that the contacts can apply ([Danielczuk2019] Sect. 4.2)."""

from __future__ import annotations

import numpy as np

from reach.arrays import FloatArray, IntArray
from reach.kernels.compiling import compiled, compiled_reductions

SMALLEST_SQUARE = 1e-20
"""Squared speeds below this, for directions of unit length, are rounding errors, and not divided by."""


@compiled_reductions
def friction_support(
    points: FloatArray, start: int, stop: int, d: FloatArray, wrench: FloatArray
) -> float:
    """Support of a range of friction points; the wrench that attains it is added to `wrench`.

    Args:
        points: as in [elements][reach.kernels.elements], shape (POINT, P).
        start: first column.
        stop: column after the last.
        d: direction: velocity and scaled angular velocity, shape (6,).
        wrench: shape (6,).
    """
    vx, vy, vz, wx, wy, wz = d[0], d[1], d[2], d[3], d[4], d[5]
    value, f0, f1, f2, t0, t1, t2 = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    for p in range(start, stop):
        x, y, z = points[0, p], points[1, p], points[2, p]
        ux = vx + wy * z - wz * y
        uy = vy + wz * x - wx * z
        uz = vz + wx * y - wy * x
        mx = points[3, p] * ux + points[6, p] * uy + points[7, p] * uz
        my = points[6, p] * ux + points[4, p] * uy + points[8, p] * uz
        mz = points[7, p] * ux + points[8, p] * uy + points[5, p] * uz
        turn = points[9, p] * wx + points[10, p] * wy + points[11, p] * wz
        root = np.sqrt(max(mx * ux + my * uy + mz * uz + turn * turn, SMALLEST_SQUARE))
        value += points[12, p] * root
        s = points[12, p] / root
        fx, fy, fz, t = s * mx, s * my, s * mz, s * turn
        f0 += fx
        f1 += fy
        f2 += fz
        t0 += y * fz - z * fy + t * points[9, p]
        t1 += z * fx - x * fz + t * points[10, p]
        t2 += x * fy - y * fx + t * points[11, p]
    wrench[0] += f0
    wrench[1] += f1
    wrench[2] += f2
    wrench[3] += t0
    wrench[4] += t1
    wrench[5] += t2
    return value


@compiled
def support(
    normals: FloatArray,
    points: FloatArray,
    starts: IntArray,
    d: FloatArray,
    wrench: FloatArray,
    part: FloatArray,
) -> float:
    """Support function of Lambda and the wrench that attains it.

    Every contact's normal forces share one scale between zero and one, so a contact contributes
    its whole set or nothing: h(d) = sum over contacts of max(0, w_n . d + friction(d)).

    Args:
        normals: wrench of each contact's pressure, shape (J, 6), torques scaled.
        points: friction points of all contacts, shape (POINT, P).
        starts: first point of each contact, and the end, shape (J + 1,).
        d: direction, shape (6,).
        wrench: receives the wrench of Lambda farthest along d, shape (6,).
        part: scratch, shape (6,).
    """
    wrench[:] = 0.0
    total = 0.0
    for contact in range(len(normals)):
        value = 0.0
        for i in range(6):
            part[i] = normals[contact, i]
            value += part[i] * d[i]
        value += friction_support(points, starts[contact], starts[contact + 1], d, part)
        if value > 0.0:
            total += value
            for i in range(6):
                wrench[i] += part[i]
    return total
