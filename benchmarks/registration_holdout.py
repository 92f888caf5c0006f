"""Parts that nobody tuned on: each kind of shape drawn anew from a seed.

Every kind is hard in its own way: nearly round, nearly symmetric under a turn, told apart only by
a small key, thin-walled, or without any feature. Dimensions are those of parts that a small
gripper holds.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from benchmarks.registration_objects import as_part
from reach import GraspObject
from reach.arrays import FloatArray, IntArray

Rng = np.random.Generator


def holdout_part(kind: str, seed: int) -> GraspObject:
    """Draw one of the KINDS from a seed."""
    rng = np.random.default_rng([seed, list(KINDS).index(kind)])
    drawn = as_part(f"{kind}_{seed}", KINDS[kind](rng))
    return GraspObject(drawn.name, drawn.vertices, _in_order(drawn.faces), mass=drawn.mass)


def _in_order(faces: IntArray) -> IntArray:
    """The same triangles in one order: a hull that is found in parallel lists them by chance."""
    start = np.argmin(faces, axis=1)
    turned = faces[np.arange(len(faces))[:, None], (start[:, None] + np.arange(3)) % 3]
    return turned[np.lexsort(turned.T[::-1])]


def _superellipsoid(radii: FloatArray, east: float, north: float) -> Any:
    """Hull of |x/a|^(2/e) .. = 1 with exponents e: 1 is an ellipsoid, small is a box [Barr1981]."""
    from manifold3d import Manifold

    u, v = np.meshgrid(np.linspace(-np.pi, np.pi, 64, endpoint=False), np.linspace(-1.5, 1.5, 33))

    def power(x: FloatArray, exponent: float) -> FloatArray:
        return np.sign(x) * np.abs(x) ** exponent

    ring = power(np.cos(v), north)
    points = np.stack(
        [ring * power(np.cos(u), east), ring * power(np.sin(u), east), power(np.sin(v), north)],
        axis=-1,
    )
    return Manifold.hull_points((points * radii).reshape(-1, 3))


def _round_superellipsoid(rng: Rng) -> Any:
    radii = rng.uniform(14, 20) * rng.uniform(0.85, 1.15, 3)
    return _superellipsoid(radii, rng.uniform(0.7, 1.1), rng.uniform(0.7, 1.1))


def _boxy_superellipsoid(rng: Rng) -> Any:
    return _superellipsoid(rng.uniform(12, 28, 3), rng.uniform(0.2, 0.5), rng.uniform(0.2, 0.5))


def _near_sphere(rng: Rng) -> Any:
    return _superellipsoid(rng.uniform(17, 20) * np.array([1.0, 0.95, 0.9]), 1.0, 1.0)


def _lemon(rng: Rng) -> Any:
    """Long and round with a tip at one end, a little flattened."""
    from manifold3d import Manifold

    body = Manifold.sphere(16, 48).scale([1.4, 1.0, rng.uniform(0.9, 0.98)])
    tip = Manifold.cylinder(10, 5, 2, 24).rotate([0, 90, 0]).translate([16, 0, rng.uniform(-2, 2)])
    return body + tip


def _keyed_cylinder(rng: Rng) -> Any:
    from manifold3d import Manifold

    radius, height, key = rng.uniform(10, 18), rng.uniform(25, 60), rng.uniform(1.5, 3)
    body = Manifold.cylinder(height, radius, radius, 64)
    return body + _block((2 * key, key, height / 2), (radius, 0, 0))


def _slotted_cylinder(rng: Rng) -> Any:
    from manifold3d import Manifold

    radius, slot = rng.uniform(12, 20), rng.uniform(2, 4)
    body = Manifold.cylinder(rng.uniform(12, 40), radius, radius, 64)
    return body - _block((2 * slot, slot, 100), (radius, 0, 0))


def _flatted_shaft(rng: Rng) -> Any:
    from manifold3d import Manifold

    radius, height = rng.uniform(9, 14), rng.uniform(40, 70)
    shaft = Manifold.cylinder(height, radius, radius, 64)
    shaft += Manifold.cylinder(height / 4, 1.3 * radius, 1.3 * radius, 64)
    flat = rng.uniform(0.15, 0.35) * radius
    return shaft - _block((2 * flat, 60, height), (radius, 0, height * 0.8))


def _tapered_box(rng: Rng) -> Any:
    x, y, z = rng.uniform(25, 50, 3)
    taper = rng.uniform(0.85, 0.95)
    from manifold3d import Manifold

    corners = np.array([(sx, sy, 0) for sx in (-1, 1) for sy in (-1, 1)]) * [x / 2, y / 2, 0]
    return Manifold.hull_points(np.concatenate([corners, corners * taper + [0, 0, z]]))


def _near_cube(rng: Rng) -> Any:
    side = rng.uniform(25, 35)
    return _block(side * np.array([1.0, *rng.uniform(1.02, 1.15, 2)]), (0, 0, 0))


def _l_profile(rng: Rng) -> Any:
    a, b, length, wall = *rng.uniform(20, 40, 2), rng.uniform(25, 60), rng.uniform(3, 6)
    return _block((a, length, wall), (a / 2, 0, wall / 2)) + _block(
        (wall, length, b), (wall / 2, 0, b / 2)
    )


def _t_profile(rng: Rng) -> Any:
    a, b, length, wall = *rng.uniform(20, 40, 2), rng.uniform(25, 60), rng.uniform(3, 6)
    return _block((a, length, wall), (0, 0, wall / 2)) + _block((wall, length, b), (0, 0, b / 2))


def _u_profile(rng: Rng) -> Any:
    a, length, wall = rng.uniform(25, 40), rng.uniform(25, 60), rng.uniform(3, 6)
    first, second = rng.uniform(15, 25) + np.array([0.0, rng.uniform(2, 8)])
    return (
        _block((a, length, wall), (0, 0, wall / 2))
        + _block((wall, length, first), (-a / 2, 0, first / 2))
        + _block((wall, length, second), (a / 2, 0, second / 2))
    )


def _bumped_torus(rng: Rng) -> Any:
    from manifold3d import CrossSection, Manifold

    ring, tube = rng.uniform(15, 22), rng.uniform(5, 8)
    torus = Manifold.revolve(CrossSection.circle(tube, 32).translate([ring, 0]), 64)
    at = np.radians(rng.uniform(0, 60))
    place = [ring + tube * np.cos(at), 0, tube * np.sin(at)]
    return torus + Manifold.sphere(rng.uniform(3, 5), 24).translate(place)


def _notched_nut(rng: Rng) -> Any:
    from manifold3d import Manifold

    radius, height = rng.uniform(15, 24), rng.uniform(10, 20)
    nut = Manifold.cylinder(height, radius, radius, 6)
    nut -= Manifold.cylinder(3 * height, radius / 2, radius / 2, 48).translate([0, 0, -height])
    return nut - _block((rng.uniform(4, 7), rng.uniform(3, 6), 100), (radius * 0.86, 0, 0))


def _eccentric_disc(rng: Rng) -> Any:
    from manifold3d import Manifold

    radius, height = rng.uniform(16, 25), rng.uniform(10, 20)
    disc = Manifold.cylinder(height, radius, radius, 64)
    hole = Manifold.cylinder(100, radius / 3, radius / 3, 48)
    return disc - hole.translate([radius * rng.uniform(0.15, 0.5), 0, -50])


def _uneven_knob(rng: Rng) -> Any:
    """Three lobes, one of them longer."""
    from manifold3d import Manifold

    height, reach, longer = rng.uniform(12, 25), rng.uniform(14, 18), rng.uniform(1.5, 4)
    knob = Manifold.cylinder(height * 1.4, 9, 7, 48)
    for i in range(3):
        lobe = Manifold.cylinder(height, 6, 6, 32).translate([reach + longer * (i == 0), 0, 0])
        arm = _block((reach, 7, height), (reach / 2, 0, height / 2))
        knob += (lobe + arm).rotate([0, 0, 120.0 * i])
    return knob


def _stone(rng: Rng) -> Any:
    """Hull of points about an ellipsoid: no feature but its faces."""
    from manifold3d import Manifold

    points = rng.normal(size=(18, 3))
    points /= np.linalg.norm(points, axis=1)[:, None]
    return Manifold.hull_points(points * rng.uniform(14, 26, 3))


def _block(size: Any, center: Any) -> Any:
    from manifold3d import Manifold

    return Manifold.cube(list(map(float, size)), True).translate(list(map(float, center)))


KINDS: dict[str, Callable[[Rng], Any]] = {
    "round_superellipsoid": _round_superellipsoid,
    "boxy_superellipsoid": _boxy_superellipsoid,
    "near_sphere": _near_sphere,
    "lemon": _lemon,
    "keyed_cylinder": _keyed_cylinder,
    "slotted_cylinder": _slotted_cylinder,
    "flatted_shaft": _flatted_shaft,
    "tapered_box": _tapered_box,
    "near_cube": _near_cube,
    "l_profile": _l_profile,
    "t_profile": _t_profile,
    "u_profile": _u_profile,
    "bumped_torus": _bumped_torus,
    "notched_nut": _notched_nut,
    "eccentric_disc": _eccentric_disc,
    "uneven_knob": _uneven_knob,
    "stone": _stone,
}
