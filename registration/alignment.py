"""Gauss-Newton on a signed-distance grid, for many hypotheses at once, one thread, no BLAS.

Each hypothesis minimizes a robust (Geman-McClure) sum of the squared distances of observed
points from the model's surface. The planar version turns and slides the part on the table; the
rigid one moves it freely, held by a prior.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from reach.arrays import FloatArray
from reach.kernels.cholesky import solve_definite
from reach.kernels.compiling import compiled
from registration.sdf import distance_and_gradient


@compiled
def align_planar(
    values: NDArray[np.float32],
    origin: FloatArray,
    inverse_spacing: float,
    points: FloatArray,
    T_table_object: FloatArray,
    scales: FloatArray,
) -> tuple[FloatArray, FloatArray]:
    """Turn about the table's normal and slide on the table, each hypothesis by itself.

    Args:
        values: signed distances, shape (nx, ny, nz) [m].
        origin: of the grid, shape (3,), object frame [m].
        inverse_spacing: of the grid [1/m].
        points: observed, shape (M, 3), table frame (z up) [m].
        T_table_object: starting poses, shape (N, 4, 4).
        scales: robust scale of each iteration, shape (I,) [m].

    Returns:
        Poses (N, 4, 4) and their mean robust losses at the last scale, in [0, 1], shape (N,).
    """
    n, m = len(T_table_object), len(points)
    result = T_table_object.copy()
    loss = np.zeros(n)
    for h in range(n):
        T = result[h]
        for step in range(len(scales) + 1):
            last = step == len(scales)
            c2 = scales[min(step, len(scales) - 1)] ** 2
            h00, h01, h02, h11, h12, h22 = 1e-9, 0.0, 0.0, 1e-6, 0.0, 1e-6
            b0, b1, b2, total = 0.0, 0.0, 0.0, 0.0
            for p in range(m):
                dx = points[p, 0] - T[0, 3]
                dy = points[p, 1] - T[1, 3]
                dz = points[p, 2] - T[2, 3]
                r, gx, gy, gz = distance_and_gradient(
                    values,
                    origin,
                    inverse_spacing,
                    T[0, 0] * dx + T[1, 0] * dy + T[2, 0] * dz,
                    T[0, 1] * dx + T[1, 1] * dy + T[2, 1] * dz,
                    T[0, 2] * dx + T[1, 2] * dy + T[2, 2] * dz,
                )
                total += r * r / (r * r + c2)
                weight = (c2 / (r * r + c2)) ** 2
                jx = -(T[0, 0] * gx + T[0, 1] * gy + T[0, 2] * gz)
                jy = -(T[1, 0] * gx + T[1, 1] * gy + T[1, 2] * gz)
                ja = jy * dx - jx * dy
                h00 += weight * ja * ja
                h01 += weight * ja * jx
                h02 += weight * ja * jy
                h11 += weight * jx * jx
                h12 += weight * jx * jy
                h22 += weight * jy * jy
                b0 += weight * ja * r
                b1 += weight * jx * r
                b2 += weight * jy * r
            loss[h] = total / m
            if last:
                break
            c00 = h11 * h22 - h12 * h12
            c01 = h02 * h12 - h01 * h22
            c02 = h01 * h12 - h02 * h11
            det = h00 * c00 + h01 * c01 + h02 * c02
            if det <= 1e-30:
                break
            c11, c12, c22 = h00 * h22 - h02 * h02, h01 * h02 - h00 * h12, h00 * h11 - h01 * h01
            angle = -(c00 * b0 + c01 * b1 + c02 * b2) / det
            x = -(c01 * b0 + c11 * b1 + c12 * b2) / det
            y = -(c02 * b0 + c12 * b1 + c22 * b2) / det
            angle = min(max(angle, -0.3), 0.3)
            length = (x * x + y * y) ** 0.5
            shrink = min(1.0, 0.02 / max(length, 1e-12))
            ca, sa = np.cos(angle), np.sin(angle)
            for j in range(3):
                t0, t1 = T[0, j], T[1, j]
                T[0, j], T[1, j] = ca * t0 - sa * t1, sa * t0 + ca * t1
            T[0, 3] += shrink * x
            T[1, 3] += shrink * y
    return result, loss


@compiled
def align_rigid(
    values: NDArray[np.float32],
    origin: FloatArray,
    inverse_spacing: float,
    points: FloatArray,
    T_table_object: FloatArray,
    scales: FloatArray,
    prior: FloatArray,
) -> tuple[FloatArray, FloatArray]:
    """Move freely, each hypothesis by itself.

    Args:
        values: signed distances, shape (nx, ny, nz) [m].
        origin: of the grid, shape (3,), object frame [m].
        inverse_spacing: of the grid [1/m].
        points: observed, shape (M, 3), table frame [m].
        T_table_object: starting poses, shape (N, 4, 4).
        scales: robust scale of each iteration, shape (I,) [m].
        prior: information that holds a step back, per point, diagonal of (rotation [1/rad^2],
            translation [1/m^2]) times the squared residual unit, shape (6,).

    Returns:
        Poses (N, 4, 4) and their mean robust losses at the last scale, in [0, 1], shape (N,).
    """
    n, m = len(T_table_object), len(points)
    result = T_table_object.copy()
    loss = np.zeros(n)
    jacobian = np.zeros(6)
    for h in range(n):
        T = result[h]
        for step in range(len(scales) + 1):
            c2 = scales[min(step, len(scales) - 1)] ** 2
            hessian, gradient, total = np.zeros((6, 6)), np.zeros(6), 0.0
            for p in range(m):
                dx = points[p, 0] - T[0, 3]
                dy = points[p, 1] - T[1, 3]
                dz = points[p, 2] - T[2, 3]
                x = T[0, 0] * dx + T[1, 0] * dy + T[2, 0] * dz
                y = T[0, 1] * dx + T[1, 1] * dy + T[2, 1] * dz
                z = T[0, 2] * dx + T[1, 2] * dy + T[2, 2] * dz
                r, gx, gy, gz = distance_and_gradient(values, origin, inverse_spacing, x, y, z)
                total += r * r / (r * r + c2)
                weight = (c2 / (r * r + c2)) ** 2
                # T exp(xi): the point moves by -(omega x p + v) in the object's frame.
                jacobian[0], jacobian[1], jacobian[2] = (
                    -(y * gz - z * gy),
                    -(z * gx - x * gz),
                    -(x * gy - y * gx),
                )
                jacobian[3], jacobian[4], jacobian[5] = -gx, -gy, -gz
                for i in range(6):
                    wi = weight * jacobian[i]
                    gradient[i] += wi * r
                    for j in range(i + 1):
                        hessian[i, j] += wi * jacobian[j]
            loss[h] = total / m
            if step == len(scales):
                break
            for i in range(6):
                hessian[i, i] += m * prior[i]
                for j in range(i):
                    hessian[j, i] = hessian[i, j]
            xi = -solve_definite(hessian, gradient)
            turn = (xi[0] ** 2 + xi[1] ** 2 + xi[2] ** 2) ** 0.5
            way = (xi[3] ** 2 + xi[4] ** 2 + xi[5] ** 2) ** 0.5
            xi *= min(1.0, 0.3 / max(turn, 1e-12), 0.02 / max(way, 1e-12))
            _move(T, xi)
    return result, loss


@compiled
def _move(T: FloatArray, xi: FloatArray) -> None:
    """Apply T exp(xi) in place: Rodrigues' formula, translation to first order in the turn."""
    angle = (xi[0] ** 2 + xi[1] ** 2 + xi[2] ** 2) ** 0.5
    R = T[:3, :3].copy()
    for i in range(3):
        T[i, 3] += R[i, 0] * xi[3] + R[i, 1] * xi[4] + R[i, 2] * xi[5]
    if angle < 1e-12:
        return
    kx, ky, kz = xi[0] / angle, xi[1] / angle, xi[2] / angle
    s, c = np.sin(angle), 1.0 - np.cos(angle)
    turn = np.array(
        [
            [1 - c * (ky * ky + kz * kz), c * kx * ky - s * kz, c * kx * kz + s * ky],
            [c * kx * ky + s * kz, 1 - c * (kx * kx + kz * kz), c * ky * kz - s * kx],
            [c * kx * kz - s * ky, c * ky * kz + s * kx, 1 - c * (kx * kx + ky * ky)],
        ]
    )
    for i in range(3):
        for j in range(3):
            T[i, j] = R[i, 0] * turn[0, j] + R[i, 1] * turn[1, j] + R[i, 2] * turn[2, j]
