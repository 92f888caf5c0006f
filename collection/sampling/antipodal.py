"""Pairs of opposite contacts by ray shooting."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass

import numpy as np

from reach.arrays import FloatArray, IntArray
from reach.raycast import RaycastScene

_ENTRY = 1e-6
"""Crossings this close to the ray's start are the start itself [m]."""


@dataclass(frozen=True, slots=True, eq=False)
class Surface:
    """A triangle mesh prepared for shooting rays through it.

    Args:
        triangles: corner points, shape (F, 3, 3), object frame [m].
        normals: outward unit normals, shape (F, 3).
        areas: shape (F,) [m^2].
        scene: for the rays.
    """

    triangles: FloatArray
    normals: FloatArray
    areas: FloatArray
    scene: RaycastScene

    @classmethod
    def of(cls, vertices: FloatArray, faces: IntArray) -> Surface:
        """Prepare a mesh of vertices (V, 3) [m] and faces (F, 3)."""
        triangles = vertices[faces]
        cross = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
        length = np.linalg.norm(cross, axis=1)
        normals = np.divide(
            cross, length[:, None], out=np.zeros_like(cross), where=length[:, None] > 0
        )
        return cls(triangles, normals, length / 2, RaycastScene(vertices, faces))


@dataclass(frozen=True, slots=True, eq=False)
class ContactPairs:
    """Opposite contacts: points (N, 2, 3) [m] and faces (N, 2) of the surface."""

    points: FloatArray
    faces: IntArray

    @property
    def widths(self) -> FloatArray:
        """Distance of the two contacts, shape (N,) [m]."""
        widths: FloatArray = np.linalg.norm(self.points[:, 1] - self.points[:, 0], axis=1)
        return widths

    @property
    def axes(self) -> FloatArray:
        """Unit vectors from the first contact to the second, shape (N, 3)."""
        axes: FloatArray = (self.points[:, 1] - self.points[:, 0]) / self.widths[:, None]
        return axes


def contact_pairs(
    surface: Surface,
    count: int,
    rng: np.random.Generator,
    *,
    normal_angle: float,
    width_limits: tuple[float, float],
) -> tuple[ContactPairs, Counter[str]]:
    """Shoot rays into a part and keep the pairs of contacts that oppose each other.

    A ray starts at a random surface point within an angle of the inward normal. Of all places
    where it leaves the solid within the jaws' reach one is drawn, so that a hollow part is held
    by its wall as well as across.

    Args:
        surface: of the part.
        count: number of rays.
        rng: source of randomness.
        normal_angle: largest angle of the closing axis to both normals [rad].
        width_limits: least and largest distance of the contacts [m].

    Returns:
        The pairs, and how many rays were discarded why.
    """
    starts, faces = _random_points(surface, count, rng)
    directions = _cone(surface, faces, normal_angle, rng)
    ray, distance, face = surface.scene.cast_all(starts, directions)
    leaves = np.einsum("ij,ij->i", surface.normals[face], directions[ray]) > 0
    exits = leaves & (distance > _ENTRY)
    fits = exits & (distance >= width_limits[0]) & (distance <= width_limits[1])
    crossing = _draw_one(ray, fits, count, rng)

    found = crossing >= 0
    has_exit = np.bincount(ray[exits], minlength=count) > 0
    thick = np.bincount(ray[exits & (distance > width_limits[1])], minlength=count) > 0
    chosen = crossing[found]
    opposed = np.einsum("ij,ij->i", surface.normals[face[chosen]], directions[found]) >= np.cos(
        normal_angle
    )
    discarded = Counter(
        {
            "single contact": int((~has_exit).sum()),
            "too wide": int((~found & has_exit & thick).sum()),
            "too thin": int((~found & has_exit & ~thick).sum()),
            "not antipodal": int((~opposed).sum()),
        }
    )
    kept, chosen = np.flatnonzero(found)[opposed], chosen[opposed]
    ends = starts[kept] + distance[chosen, None] * directions[kept]
    pairs = ContactPairs(
        np.stack([starts[kept], ends], axis=1), np.stack([faces[kept], face[chosen]], axis=1)
    )
    return pairs, discarded


def _random_points(
    surface: Surface, count: int, rng: np.random.Generator
) -> tuple[FloatArray, IntArray]:
    """Points uniform over the surface (N, 3) [m], and their faces (N,)."""
    faces = rng.choice(len(surface.areas), count, p=surface.areas / surface.areas.sum())
    root, along = np.sqrt(rng.random(count)), rng.random(count)
    weights = np.column_stack([1 - root, root * (1 - along), root * along])
    return np.einsum("ij,ijk->ik", weights, surface.triangles[faces]), faces


def _cone(
    surface: Surface, faces: IntArray, half_angle: float, rng: np.random.Generator
) -> FloatArray:
    """Directions uniform in the cone about each face's inward normal, shape (N, 3)."""
    inward = -surface.normals[faces]
    # The frame hangs on the face's first edge, so that it moves with the part.
    edge = surface.triangles[faces, 1] - surface.triangles[faces, 0]
    first = edge / np.linalg.norm(edge, axis=1, keepdims=True)
    second = np.cross(inward, first)
    cosine = 1 - rng.random(len(faces)) * (1 - np.cos(half_angle))
    sine = np.sqrt(1 - cosine**2)
    turn = 2 * np.pi * rng.random(len(faces))
    directions: FloatArray = (
        cosine[:, None] * inward
        + (sine * np.cos(turn))[:, None] * first
        + (sine * np.sin(turn))[:, None] * second
    )
    return directions


def _draw_one(ray: IntArray, allowed: np.ndarray, rays: int, rng: np.random.Generator) -> IntArray:
    """One allowed crossing of each ray at random, -1 where there is none, shape (rays,)."""
    candidates = np.flatnonzero(allowed)
    counts = np.bincount(ray[candidates], minlength=rays)
    first = np.cumsum(counts) - counts  # crossings are sorted by ray
    pick = first + np.floor(rng.random(rays) * counts).astype(np.int64)
    chosen = np.full(rays, -1, dtype=np.int64)
    chosen[counts > 0] = candidates[pick[counts > 0]]
    return chosen
