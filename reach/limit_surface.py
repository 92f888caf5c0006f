"""Ellipsoidal limit surface of a triangle, and its linearization ([Danielczuk2019] Eq. 4.1)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from reach.arrays import FloatArray, frozen


def _directions() -> FloatArray:
    def ring(count: int, latitude: float) -> list[tuple[float, float, float]]:
        turns = 2.0 * np.pi * np.arange(count) / count
        c, s = np.cos(latitude), np.sin(latitude)
        return [(c * np.cos(turn), c * np.sin(turn), s) for turn in turns]

    quarter = np.pi / 4.0
    poles = [(0.0, 0.0, 1.0), (0.0, 0.0, -1.0)]
    return frozen(ring(8, 0.0) + ring(4, quarter) + ring(4, -quarter) + poles)


DIRECTIONS = _directions()
"""18 points of the unit sphere, shape (18, 3): every 45 degrees of latitude, and on the equator of
longitude. The ellipsoid of Eq. 4.1 is replaced by the planes that touch it there: with
phi = (f_x / f_t,max, f_y / f_t,max, tau_z / tau_z,max) of a triangle and s the common scale of the
contact's normal forces, u . phi <= s for every point u. Together with f_z >= 0 and tau_x = tau_y =
0, each two inequalities, these are the paper's 23 constraints a triangle."""


@dataclass(frozen=True, slots=True, eq=False)
class TriangleContacts:
    """Triangles of one contact, each with its limit surface.

    Attributes:
        T_frame_triangle: pose of each triangle's frame, shape (M, 4, 4).
        normal_force: f_z,max, shape (M,) [N].
        tangential: f_t,max = mu f_z,max, shape (M,) [N].
        torsion: tau_z,max, shape (M,) [N m].
    """

    T_frame_triangle: FloatArray
    normal_force: FloatArray
    tangential: FloatArray
    torsion: FloatArray

    def __len__(self) -> int:
        return len(self.normal_force)


def overshoot() -> float:
    """How far the linearized ellipsoid reaches beyond the exact one at most (a factor above 1)."""
    from scipy.spatial import HalfspaceIntersection

    planes = np.column_stack([DIRECTIONS, -np.ones(len(DIRECTIONS))])
    corners = HalfspaceIntersection(planes, np.zeros(3)).intersections
    return float(np.linalg.norm(corners, axis=1).max())
