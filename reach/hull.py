"""The convex hull about a center of mass, and the height function it defines.

Height over the table as a function of the direction that points down: its minima are the
facets a part rests on, its saddles are edges it can topple over, its maxima are vertices.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from reach.arrays import FloatArray, IntArray
from reach.errors import InvalidMeshError


@dataclass(frozen=True, slots=True, eq=False)
class Hull:
    """Triangulated convex hull of a part, relative to its center of mass.

    Args:
        triangles: corners relative to the center of mass, shape (F, 3, 3) [m].
        corners: vertex indices into the mesh, shape (F, 3).
        normals: outward unit normals, shape (F, 3).
        neighbors: facet across the edge opposite to each corner, shape (F, 3).
    """

    triangles: FloatArray
    corners: IntArray
    normals: FloatArray
    neighbors: IntArray

    @property
    def heights(self) -> FloatArray:
        """Height of the center of mass over each facet's plane, shape (F,) [m]."""
        heights: FloatArray = np.einsum("fi,fki->fk", self.normals, self.triangles).mean(axis=1)
        return heights

    @property
    def insets(self) -> FloatArray:
        """How far the center's foot lies inside each edge's line, in the facet, (F, 3) [m].

        Negative where the part topples over that edge.
        """
        first = np.roll(self.triangles, -1, axis=1)  # the edge opposite to corner k
        edges = np.roll(self.triangles, -2, axis=1) - first
        inward = np.cross(self.normals[:, None], edges)
        # Qhull does not order the corners: turn each edge's normal toward its opposite corner.
        inward *= np.sign(np.einsum("fki,fki->fk", self.triangles - first, inward))[..., None]
        length = np.linalg.norm(inward, axis=2)
        offset = np.einsum("fki,fki->fk", inward, -first)
        insets: FloatArray = np.divide(offset, length, out=np.zeros_like(offset), where=length > 0)
        return insets

    @property
    def solid_angles(self) -> FloatArray:
        """Share of all directions that each facet takes up, seen from the center, shape (F,).

        By the formula of Van Oosterom and Strackee, exact for triangles [VanOosterom1983].
        """
        a, b, c = np.moveaxis(self.triangles, 1, 0)
        la, lb, lc = (np.linalg.norm(x, axis=1) for x in (a, b, c))
        numerator = np.abs(np.einsum("ij,ij->i", a, np.cross(b, c)))
        denominator = (
            la * lb * lc
            + np.einsum("ij,ij->i", a, b) * lc
            + np.einsum("ij,ij->i", b, c) * la
            + np.einsum("ij,ij->i", c, a) * lb
        )
        share: FloatArray = 2 * np.arctan2(numerator, denominator) / (4 * np.pi)
        return share

    def critical_directions(self) -> FloatArray:
        """Unit directions (N, 3) of minima, saddles and maxima, the minima first."""
        insets = self.insets
        slack = 1e-9 + 1e-6 * float(np.linalg.norm(self.triangles, axis=2).max())
        minima = self.normals[(insets >= -slack).all(axis=1)]
        rows, slots = np.nonzero(insets >= -slack)
        across = self.neighbors[rows, slots]
        back = np.argmax(self.neighbors[across] == rows[:, None], axis=1)
        saddle = (insets[across, back] >= -slack) & (rows < across)
        rows, slots = rows[saddle], slots[saddle]
        start = self.triangles[rows, (slots + 1) % 3]
        edge = self.triangles[rows, (slots + 2) % 3] - start
        share = -np.einsum("ij,ij->i", start, edge) / np.einsum("ij,ij->i", edge, edge)
        feet = start + share[:, None] * edge
        points = np.concatenate([minima, feet[(share >= 0) & (share <= 1)], self._peaks()])
        directions: FloatArray = points / np.linalg.norm(points, axis=1, keepdims=True)
        return directions

    def _peaks(self) -> FloatArray:
        """Corners farther from the center than all their neighbors, shape (N, 3) [m]."""
        ids, first = np.unique(self.corners, return_index=True)
        points = self.triangles.reshape(-1, 3)[first]
        index = np.searchsorted(ids, self.corners)
        radius = np.linalg.norm(points, axis=1)
        peak = np.ones(len(ids), dtype=bool)
        for k in range(3):
            a, b = index[:, k], index[:, (k + 1) % 3]
            lower = radius[a] < radius[b] * (1 - 1e-6)
            higher = radius[b] < radius[a] * (1 - 1e-6)
            peak[a[lower]] = False
            peak[b[higher]] = False
        return points[peak]


def convex_hull(vertices: FloatArray, center: FloatArray) -> Hull:
    """Convex hull of vertices (V, 3) [m] about a center (3,) inside it.

    Raises:
        InvalidMeshError: the center lies outside the hull.
    """
    from scipy.spatial import ConvexHull

    points = vertices - center
    hull = ConvexHull(points)
    if hull.equations[:, 3].max() >= 0:
        raise InvalidMeshError(f"the center of mass {center} lies outside the part's convex hull")
    return Hull(
        points[hull.simplices],
        hull.simplices.astype(np.int64),
        hull.equations[:, :3].copy(),
        hull.neighbors.astype(np.int64),
    )
