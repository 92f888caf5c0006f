"""Proper rotations about the center of mass that map a part's surface to itself.

The distribution of mass restricts the candidates: a symmetry maps the principal axes of inertia
to themselves. What is left is tried on points of the surface. A part of revolution made of many
facets counts as continuous when its facets stay within the tolerance of the round shape.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from reach.arrays import FloatArray, frozen, frozen_finite
from reach.cache import cache_key, cached_arrays
from reach.transforms import make_transform, rotation_about

if TYPE_CHECKING:
    from reach.objects import GraspObject

VERSION = 4
RELATIVE_TOLERANCE = 7.5e-3
LARGEST_TOLERANCE = 4e-4
"""A rotation is a symmetry if no surface point leaves the surface by more than the smaller of
RELATIVE_TOLERANCE times the span about the center and LARGEST_TOLERANCE [m]."""


@dataclass(frozen=True, slots=True, eq=False)
class Symmetry:
    """The rotational symmetry of a part about its center of mass.

    Args:
        rotations: finite proper rotations, the identity first, shape (K, 3, 3), object frame.
        axis: axis of revolution, shape (3,), or None; with an axis, `rotations` holds the
            identity and, if the part can be turned end over end, one half turn.
        center: fixed point of all rotations (the center of mass), shape (3,) [m].
        sphere: every rotation is a symmetry.
    """

    rotations: FloatArray
    axis: FloatArray | None
    center: FloatArray
    sphere: bool = False

    def __post_init__(self) -> None:
        set_field = object.__setattr__
        set_field(self, "rotations", frozen_finite(self.rotations, "rotations", (-1, 3, 3)))
        set_field(self, "center", frozen_finite(self.center, "center", (3,)))
        if self.axis is not None:
            axis = frozen_finite(self.axis, "axis", (3,))
            set_field(self, "axis", frozen(axis / np.linalg.norm(axis)))

    def transforms(self, obj: GraspObject | None = None) -> FloatArray:
        """Finite symmetries as poses T_object_object, shape (K, 4, 4).

        Args:
            obj: takes its center of mass as the fixed point instead of `center`.
        """
        center = self.center if obj is None else obj.com
        return np.array([make_transform(R, center - R @ center) for R in self.rotations])

    def equivalent_directions(self, a: FloatArray, b: FloatArray) -> float:
        """Smallest angle [rad] between unit vector b (3,) and a symmetric copy of a (3,)."""
        if self.sphere:
            return 0.0
        copies = self.rotations @ a
        if self.axis is not None:  # only the polar angle about the axis tells copies apart
            polar = np.arccos(np.clip(copies @ self.axis, -1, 1))
            return float(np.abs(polar - np.arccos(np.clip(b @ self.axis, -1, 1))).min())
        return float(np.arccos(np.clip(copies @ b, -1, 1)).min())


def symmetry(obj: GraspObject) -> Symmetry:
    """Find the rotational symmetry of a part; the result is cached by content."""
    key = cache_key("symmetry", VERSION, obj.content_hash, tuple(np.round(obj.com, 9)))

    def compute() -> dict[str, FloatArray]:
        from reach.symmetry_search import find_symmetry

        found = find_symmetry(obj)
        return {
            "rotations": found.rotations,
            "axis": np.zeros(0) if found.axis is None else found.axis,
            "sphere": np.array(float(found.sphere)),
        }

    entry = cached_arrays("symmetry", key, compute)
    axis = entry["axis"] if entry["axis"].size else None
    return Symmetry(entry["rotations"], axis, obj.com, bool(entry["sphere"]))


def pose_distance(sym: Symmetry, T_a: FloatArray, T_b: FloatArray) -> tuple[float, float]:
    """Distance of two poses of a part, up to its symmetry.

    Args:
        sym: of the part.
        T_a: pose of the object in any frame, shape (4, 4).
        T_b: pose of the object in the same frame, shape (4, 4).

    Returns:
        The smallest rotation between symmetric copies [rad], and the distance of the centers
        of mass [m], which no symmetry moves.
    """
    center_a = T_a[:3, :3] @ sym.center + T_a[:3, 3]
    center_b = T_b[:3, :3] @ sym.center + T_b[:3, 3]
    translation = float(np.linalg.norm(center_a - center_b))
    if sym.sphere:
        return 0.0, translation
    between = T_b[:3, :3].T @ T_a[:3, :3] @ sym.rotations
    if sym.axis is not None:  # the turn about the axis is free: the swing of the axis is left
        return float(_angle_between(between @ sym.axis, sym.axis).min()), translation
    # |R - 1| = 2 sqrt(2) sin(angle / 2) keeps its digits near zero, unlike the trace's arccos.
    chord = np.linalg.norm(between - np.eye(3), axis=(1, 2)) / (2 * np.sqrt(2))
    return float(2 * np.arcsin(np.clip(chord, 0, 1)).min()), translation


def tolerance(obj: GraspObject) -> float:
    """How far a surface point may leave the surface under a symmetry [m]."""
    # Not the bounding box's diagonal, which changes as the mesh is turned.
    span = 2 * float(np.linalg.norm(obj.vertices - obj.com, axis=1).max())
    return min(RELATIVE_TOLERANCE * span, LARGEST_TOLERANCE)


def half_turn(axis: FloatArray) -> FloatArray:
    """Rotation (3, 3) by 180 degrees about an axis (3,)."""
    return rotation_about(axis, np.pi)


def _angle_between(a: FloatArray, b: FloatArray) -> FloatArray:
    sine = np.linalg.norm(np.cross(a, b), axis=-1)
    angle: FloatArray = np.arctan2(sine, a @ b)
    return angle
