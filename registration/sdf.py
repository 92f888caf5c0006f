"""Signed distance of a mesh on a regular grid: fast distances and gradients for alignment."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numba import njit
from numpy.typing import NDArray

from reach.arrays import FloatArray
from registration.embree import EmbreeMesh

MARGIN = 12e-3
"""The grid reaches this far beyond the mesh's bounding box [m]."""
SPACING = 1.25e-3
"""Spacing of the grid's nodes [m], unless the part is small or very large."""
NODE_LIMITS = (250_000, 2_000_000)
"""A small part gets finer spacing up to the first number of nodes; a large one at most the second."""


@dataclass(frozen=True, slots=True, eq=False)
class SignedDistanceGrid:
    """Signed distances, negative inside, at the nodes of a regular grid in the object's frame.

    Args:
        values: shape (nx, ny, nz), float32 [m].
        origin: position of node (0, 0, 0), shape (3,), object frame [m].
        spacing: distance of neighboring nodes [m].
    """

    values: NDArray[np.float32]
    origin: FloatArray
    spacing: float


def grid_axes(vertices: FloatArray) -> tuple[FloatArray, float, tuple[int, int, int]]:
    """Origin (3,) [m], spacing [m] and node counts of the grid around a mesh's vertices (V, 3)."""
    low, high = vertices.min(axis=0) - MARGIN, vertices.max(axis=0) + MARGIN
    extents = high - low
    volume = float(np.prod(extents))
    fewest, most = NODE_LIMITS
    spacing = max(min(SPACING, (volume / fewest) ** (1 / 3)), (volume / most) ** (1 / 3))
    nx, ny, nz = (np.ceil(extents / spacing).astype(int) + 1).tolist()
    return low, spacing, (nx, ny, nz)


def sample_signed_distance(mesh: EmbreeMesh, vertices: FloatArray) -> SignedDistanceGrid:
    """Sample the signed distance of a closed mesh around its vertices (V, 3)."""
    origin, spacing, counts = grid_axes(vertices)
    axes = [origin[i] + spacing * np.arange(counts[i]) for i in range(3)]
    values = np.empty(counts, np.float32)
    for i, x in enumerate(axes[0]):  # slab by slab: a large part's nodes at once fill memory
        yz = np.stack(np.meshgrid(axes[1], axes[2], indexing="ij"), axis=-1)
        nodes = np.concatenate([np.full((*yz.shape[:2], 1), x), yz], axis=-1)
        values[i] = mesh.signed_distance(nodes)
    return SignedDistanceGrid(values, origin, spacing)


@njit(cache=True, inline="always")
def distance_and_gradient(
    values: NDArray[np.float32],
    origin: FloatArray,
    inverse_spacing: float,
    x: float,
    y: float,
    z: float,
) -> tuple[float, float, float, float]:
    """Signed distance [m] and its gradient at one point (x, y, z), object frame [m].

    Trilinear inside the grid; outside it, the distance at the nearest point of the grid plus
    the way there, so that far points still pull in the right direction.
    """
    nx, ny, nz = values.shape
    fx = (x - origin[0]) * inverse_spacing
    fy = (y - origin[1]) * inverse_spacing
    fz = (z - origin[2]) * inverse_spacing
    cx = min(max(fx, 0.0), nx - 1.000001)
    cy = min(max(fy, 0.0), ny - 1.000001)
    cz = min(max(fz, 0.0), nz - 1.000001)
    i, j, k = int(cx), int(cy), int(cz)
    a, b, c = cx - i, cy - j, cz - k
    v000, v001 = values[i, j, k], values[i, j, k + 1]
    v010, v011 = values[i, j + 1, k], values[i, j + 1, k + 1]
    v100, v101 = values[i + 1, j, k], values[i + 1, j, k + 1]
    v110, v111 = values[i + 1, j + 1, k], values[i + 1, j + 1, k + 1]
    x00, x01 = v000 + a * (v100 - v000), v001 + a * (v101 - v001)
    x10, x11 = v010 + a * (v110 - v010), v011 + a * (v111 - v011)
    y0, y1 = x00 + b * (x10 - x00), x01 + b * (x11 - x01)
    d = y0 + c * (y1 - y0)
    gz = (y1 - y0) * inverse_spacing
    gy = ((x10 - x00) * (1 - c) + (x11 - x01) * c) * inverse_spacing
    gx0 = (v100 - v000) * (1 - b) + (v110 - v010) * b
    gx1 = (v101 - v001) * (1 - b) + (v111 - v011) * b
    gx = (gx0 * (1 - c) + gx1 * c) * inverse_spacing
    ox, oy, oz = fx - cx, fy - cy, fz - cz
    outside = (ox * ox + oy * oy + oz * oz) ** 0.5
    if outside > 1e-5:
        d += outside / inverse_spacing
        gx, gy, gz = ox / outside, oy / outside, oz / outside
    return d, gx, gy, gz


@njit(cache=True, nogil=True)
def distances(
    values: NDArray[np.float32],
    origin: FloatArray,
    inverse_spacing: float,
    points: FloatArray,
    T_object_points: FloatArray,
) -> FloatArray:
    """Signed distances (N, M) [m] of points (M, 3) mapped by each transform (N, 4, 4)."""
    n, m = len(T_object_points), len(points)
    result = np.empty((n, m))
    for h in range(n):
        T = T_object_points[h]
        for p in range(m):
            x, y, z = points[p, 0], points[p, 1], points[p, 2]
            result[h, p] = distance_and_gradient(
                values,
                origin,
                inverse_spacing,
                T[0, 0] * x + T[0, 1] * y + T[0, 2] * z + T[0, 3],
                T[1, 0] * x + T[1, 1] * y + T[1, 2] * z + T[1, 3],
                T[2, 0] * x + T[2, 1] * y + T[2, 2] * z + T[2, 3],
            )[0]
    return result
