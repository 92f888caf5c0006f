"""Shop-drawing words for solids, in millimeters, over manifold3d."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TypeAlias

import numpy as np
from manifold3d import CrossSection, Manifold

Solid: TypeAlias = Manifold
Point2 = tuple[float, float]
Point3 = tuple[float, float, float]


def block(size_mm: Point3, corner_mm: Point3 = (0, 0, 0)) -> Solid:
    """A cuboid by its edges and its lowest corner."""
    return Manifold.cube(size_mm).translate(corner_mm)


def rod(
    radius_mm: float,
    length_mm: float,
    segments: int,
    *,
    base_mm: Point3 = (0, 0, 0),
    axis: str = "z",
    top_radius_mm: float | None = None,
) -> Solid:
    """A cylinder or cone from a base point along an axis of the drawing."""
    top = radius_mm if top_radius_mm is None else top_radius_mm
    solid = Manifold.cylinder(length_mm, radius_mm, top, segments)
    turns = {"x": (0, 90, 0), "y": (-90, 0, 0), "z": (0, 0, 0)}
    return solid.rotate(turns[axis]).translate(base_mm)


def turned(profile_mm: Sequence[Point2], segments: int) -> Solid:
    """A part from the lathe: a closed profile of (radius, height) turned about z."""
    return Manifold.revolve(_counter_clockwise(profile_mm), segments)


def plate(outline_mm: Sequence[Point2], thickness_mm: float) -> Solid:
    """A plate of a closed outline in x, y, standing on z = 0."""
    return Manifold.extrude(_counter_clockwise(outline_mm), thickness_mm)


def twisted(outline_mm: Sequence[Point2], height_mm: float, turn_deg: float, layers: int) -> Solid:
    """An outline drawn up along z while it turns."""
    section = _counter_clockwise(outline_mm)
    return Manifold.extrude(section, height_mm, layers, turn_deg)


def smooth(points_mm: Sequence[Point2], count: int) -> list[Point2]:
    """A smooth curve of `count` points through control points, even along its length."""
    from scipy.interpolate import CubicSpline

    points = np.asarray(points_mm, dtype=float)
    length = np.concatenate([[0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))])
    curve = CubicSpline(length, points)(np.linspace(0, length[-1], count))
    return [(float(x), float(y)) for x, y in curve]


def arc(
    center_mm: Point2, radius_mm: float, from_deg: float, to_deg: float, count: int
) -> list[Point2]:
    """Points of an arc."""
    angles = np.radians(np.linspace(from_deg, to_deg, count))
    return [
        (center_mm[0] + radius_mm * float(np.cos(a)), center_mm[1] + radius_mm * float(np.sin(a)))
        for a in angles
    ]


def ring_of(solid: Solid, count: int) -> Solid:
    """Copies of a solid evenly about z, joined."""
    copies = [solid.rotate((0, 0, 360.0 * k / count)) for k in range(count)]
    joined = copies[0]
    for copy in copies[1:]:
        joined = joined + copy
    return joined


def _counter_clockwise(outline_mm: Sequence[Point2]) -> CrossSection:
    x, y = np.asarray(outline_mm, dtype=float).T
    area = np.dot(x, np.roll(y, -1)) - np.dot(y, np.roll(x, -1))
    return CrossSection([outline_mm if area > 0 else list(reversed(outline_mm))])
