"""The search behind [symmetry][reach.symmetry.symmetry]: candidates, and the test of each.

Inertia decides where to look ([Goldstein2002] Sect. 5.4). Three different principal moments
leave half turns about the principal axes; two equal ones leave turns about the third axis and
half turns across it; three equal ones leave axes through the critical points of the hull's
height function, which every axis of symmetry must meet.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING

import numpy as np

from reach.arrays import FloatArray
from reach.hull import Hull, convex_hull
from reach.raycast import RaycastScene
from reach.symmetry import Symmetry, half_turn, tolerance
from reach.transforms import rotation_about

if TYPE_CHECKING:
    from reach.objects import GraspObject

EQUAL_MOMENTS = 0.02
"""Relative difference below which two principal moments may be equal."""
LARGEST_ORDER = 48
MAX_CRYSTAL_ORDER = 12
"""Largest order tried about each of many axes, where inertia names none."""
MAX_CRITICAL_AXES = 400
SAME_ROTATION = np.radians(2.0)
SURFACE_SAMPLES = 2000
MAX_VERTEX_SAMPLES = 4000
COARSE_SAMPLES = 300
_PROBE_ANGLES = np.arange(1, 9) * 2.399963229728653  # golden angle: hits no finite order


def find_symmetry(obj: GraspObject) -> Symmetry:
    """Search the rotational symmetry of a part about its center of mass."""
    surface = _Surface(obj)
    moments, axes = _principal_axes(obj)
    pairs_equal = np.diff(moments) <= EQUAL_MOMENTS * moments[2]
    if pairs_equal.all():
        return _search_isotropic(surface, axes)
    if pairs_equal.any():
        return _search_axial(surface, axes[2] if pairs_equal[0] else axes[0])
    return _finite(surface, [half_turn(axis) for axis in axes])


class _Surface:
    """Points of the surface about the center of mass, and their distance after a rotation."""

    def __init__(self, obj: GraspObject) -> None:
        self.center = obj.com
        self.tolerance = tolerance(obj)
        self.hull = convex_hull(obj.vertices, obj.com)
        self._scene = RaycastScene(obj.vertices - obj.com, obj.faces)
        self.points = _spread_points(obj) - obj.com

    def holds(self, rotation: FloatArray) -> bool:
        """Whether a rotation maps the surface to itself within the tolerance."""
        few = self.points[:COARSE_SAMPLES]
        return bool(
            self._scene.distance(few @ rotation.T).max() <= self.tolerance
            and self._scene.distance(self.points @ rotation.T).max() <= self.tolerance
        )

    def mean_distance(self, rotations: FloatArray) -> FloatArray:
        """Mean distance [m] of a few points from the surface after each rotation (N, 3, 3)."""
        few = self.points[:COARSE_SAMPLES]
        moved = few @ np.swapaxes(rotations, -1, -2)
        mean: FloatArray = (
            self._scene.distance(moved.reshape(-1, 3)).reshape(len(rotations), -1).mean(1)
        )
        return mean

    def revolves(self, axis: FloatArray) -> bool:
        """Whether every turn about an axis is a symmetry."""
        return all(self.holds(rotation_about(axis, angle)) for angle in _PROBE_ANGLES)


def _spread_points(obj: GraspObject) -> FloatArray:
    """Random surface points, then vertices (so that no small feature is overlooked)."""
    rng = np.random.default_rng(0)
    t = obj.triangles
    areas = np.linalg.norm(np.cross(t[:, 1] - t[:, 0], t[:, 2] - t[:, 0]), axis=1)
    chosen = rng.choice(len(t), SURFACE_SAMPLES, p=areas / areas.sum())
    u, v = np.sqrt(rng.random(SURFACE_SAMPLES)), rng.random(SURFACE_SAMPLES)
    weights = np.column_stack([1 - u, u * (1 - v), u * v])
    points = np.einsum("ij,ijk->ik", weights, t[chosen])
    step = -(-len(obj.vertices) // MAX_VERTEX_SAMPLES)
    return np.concatenate([points, obj.vertices[::step]])


def _principal_axes(obj: GraspObject) -> tuple[FloatArray, FloatArray]:
    """Second moments of the volume about the center of mass, ascending, and axes as rows (3, 3)."""
    corners = obj.triangles - obj.com
    volumes = np.linalg.det(corners) / 6.0
    sums = corners.sum(axis=1)
    second = np.einsum("t,tki,tkj->ij", volumes, corners, corners)
    second += np.einsum("t,ti,tj->ij", volumes, sums, sums)
    moments, vectors = np.linalg.eigh(second / 20.0)
    return moments, vectors.T


def _search_axial(surface: _Surface, axis: FloatArray) -> Symmetry:
    if surface.revolves(axis):
        across = np.linalg.svd(axis[None])[2][1]
        flip = half_turn(across)
        rotations = [np.eye(3), flip] if surface.holds(flip) else [np.eye(3)]
        return Symmetry(np.array(rotations), axis, surface.center)
    order = _order(surface, axis)
    generators = [rotation_about(axis, 2 * np.pi / order)] if order > 1 else []
    flip_found = _flip_across(surface, axis, order)
    return _finite(surface, generators + ([] if flip_found is None else [flip_found]))


def _order(surface: _Surface, axis: FloatArray, largest: int = LARGEST_ORDER) -> int:
    """Largest n such that every turn by a multiple of 2 pi / n is a symmetry."""
    for n in range(largest, 1, -1):
        # One turn alone deceives: a 13th of a turn nearly maps a twelve-sided bar to itself.
        if all(
            surface.holds(rotation_about(axis, 2 * np.pi * k / n)) for k in range(1, n // 2 + 1)
        ):
            return n
    return 1


def _flip_across(surface: _Surface, axis: FloatArray, order: int) -> FloatArray | None:
    """A half turn about an axis across the given one, if any is a symmetry."""
    first, second = np.linalg.svd(axis[None])[2][1:]

    def flips(phases: FloatArray) -> FloatArray:
        return np.array([half_turn(np.cos(p) * first + np.sin(p) * second) for p in phases])

    # Flip axes repeat every pi / order; look at half-degree steps, then narrow the best one.
    phases = np.arange(0.0, np.pi / order, np.radians(0.5))
    best = phases[np.argmin(surface.mean_distance(flips(phases)))]
    for width in np.radians([0.5, 0.05]):
        near = best + np.linspace(-width, width, 21)
        best = near[np.argmin(surface.mean_distance(flips(near)))]
    flip: FloatArray = flips(np.array([best]))[0]
    return flip if surface.holds(flip) else None


def _search_isotropic(surface: _Surface, axes: FloatArray) -> Symmetry:
    if all(surface.revolves(axis) for axis in axes[:2]):
        return Symmetry(np.eye(3)[None], None, surface.center, sphere=True)
    generators: list[FloatArray] = []
    for axis in _critical_axes(surface.hull):
        if any(_same_axis(axis, rotation) for rotation in generators):
            continue
        if surface.revolves(axis):
            return _search_axial(surface, axis)
        order = _order(surface, axis, largest=MAX_CRYSTAL_ORDER)
        if order > 1:
            generators.append(rotation_about(axis, 2 * np.pi / order))
    return _finite(surface, generators)


def _critical_axes(hull: Hull) -> FloatArray:
    """Lines through the center and a critical point of the hull's height, unit vectors (N, 3)."""
    directions = hull.critical_directions()
    upward = np.where(directions @ np.array([0.36, 0.48, 0.8]) < 0, -1.0, 1.0)
    axes: list[FloatArray] = []
    for direction in directions * upward[:, None]:
        if all(abs(direction @ axis) < np.cos(SAME_ROTATION / 2) for axis in axes):
            axes.append(direction)
        if len(axes) == MAX_CRITICAL_AXES:
            break
    return np.array(axes).reshape(-1, 3)


def _same_axis(axis: FloatArray, rotation: FloatArray) -> bool:
    return bool(np.linalg.norm(rotation @ axis - axis) < SAME_ROTATION / 2)


def _finite(surface: _Surface, candidates: Iterable[FloatArray]) -> Symmetry:
    """The group that those candidates generate which are symmetries."""
    generators = [rotation for rotation in candidates if surface.holds(rotation)]
    group = [np.eye(3)]
    for rotation in group:  # grows while it is walked
        for generator in generators:
            product = generator @ rotation
            if len(group) < 2 * LARGEST_ORDER and not _contains(group, product):
                group.append(product)
    return Symmetry(np.array(group), None, surface.center)


def _contains(group: list[FloatArray], rotation: FloatArray) -> bool:
    # The trace of R_a^T R_b is the sum of their products: 1 + 2 cos(angle).
    traces = np.tensordot(np.array(group), rotation, axes=([1, 2], [0, 1]))
    return bool(traces.max() > 1 + 2 * np.cos(SAME_ROTATION))
