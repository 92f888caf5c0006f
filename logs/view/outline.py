"""Lines by which a part is recognized: its sharp edges, and its rim as seen from one side."""

from __future__ import annotations

import numpy as np

from reach.arrays import FloatArray, IntArray

SHARP = np.cos(np.radians(30.0))
"""Faces whose normals are farther apart meet in a sharp edge."""
SAME = 1e-6
"""Corners that are this near are one [m]."""


def outline(triangles: FloatArray, toward: FloatArray) -> FloatArray:
    """Find the edges to draw.

    Args:
        triangles: shape (F, 3, 3) [m].
        toward: direction from which the rim is seen, shape (3,); a part without sharp edges is
            still told from its rim.

    Returns:
        Ends of each edge, shape (E, 2, 3) [m].
    """
    corners, faces = np.unique(
        np.round(triangles.reshape(-1, 3) / SAME), axis=0, return_inverse=True
    )
    sides = np.sort(faces.reshape(-1, 3)[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    edges, edge = np.unique(sides, axis=0, return_inverse=True)
    first, second = _neighbors(edge.ravel(), len(edges))
    cross = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    normals = cross / np.maximum(np.linalg.norm(cross, axis=1, keepdims=True), 1e-30)
    a, b = normals[first], normals[second]
    sharp = np.einsum("ij,ij->i", a, b) < SHARP
    rim = (a @ toward > 0) != (b @ toward > 0)
    ends: FloatArray = SAME * corners[edges[sharp | rim | (first == second)]]
    return ends


def _neighbors(edge: IntArray, count: int) -> tuple[IntArray, IntArray]:
    """First and last face at each of `count` edges; `edge` tells that of each side, shape (3 F,)."""
    order = np.argsort(edge, kind="stable")
    after = np.cumsum(np.bincount(edge, minlength=count))
    return order[np.append(0, after[:-1])] // 3, order[after - 1] // 3
