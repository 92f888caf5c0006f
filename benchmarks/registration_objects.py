"""Ten parts that are hard to register, each in its own way; also used by the tests."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from reach import GraspObject


def part(name: str) -> GraspObject:
    """Build one of the PARTS."""
    return as_part(name, PARTS[name]())


def as_part(name: str, solid: Any) -> GraspObject:
    mesh = solid.to_mesh()
    vertices = np.asarray(mesh.vert_properties[:, :3], dtype=float) * 1e-3
    return GraspObject(name, vertices, np.asarray(mesh.tri_verts), mass=0.03)


def _box(size: Sequence[float], at: Sequence[float] = (0, 0, 0)) -> Any:
    from manifold3d import Manifold

    return Manifold.cube(list(size)).translate(list(at))


def _cylinder(
    height: float, radius: float, top: float = -1.0, at: Sequence[float] = (0, 0, 0)
) -> Any:
    from manifold3d import Manifold

    return Manifold.cylinder(height, radius, top, 48).translate(list(at))


def _cube() -> Any:
    return _box((30, 30, 30))


def _bar_clamp() -> Any:
    body = _box((70, 16, 12)) + _box((12, 16, 40)) + _box((10, 16, 30), (45, 0, 0))
    return body + _cylinder(22, 4).rotate([0, 90, 0]).translate([-20, 8, 32])


def _bracket() -> Any:
    plates = _box((60, 40, 5)) + _box((5, 40, 35))
    holes = _cylinder(20, 4, at=(25, 12, -5)) + _cylinder(20, 4, at=(45, 28, -5))
    return plates - holes + _box((20, 4, 15), (4, 30, 4))


def _pawn() -> Any:
    from manifold3d import Manifold

    body = _cylinder(6, 16) + _cylinder(30, 12, 5, (0, 0, 6)) + _cylinder(3, 9, at=(0, 0, 34))
    return body + Manifold.sphere(9, 40).translate([0, 0, 43])


def _gear() -> Any:
    gear = _cylinder(12, 22)
    for angle in np.arange(0, 360, 30):
        gear += _box((8, 6, 12), (20, -3, 0)).rotate([0, 0, float(angle)])
    return gear + _cylinder(20, 10) - _cylinder(40, 5, at=(0, 0, -5))


def _keyed_gear() -> Any:
    """A gear whose only asymmetry is a keyway of 3 x 4 mm: finer than a stereo camera sees."""
    return _gear() - _box((3, 4, 40), (4, -2, -5))


def _mug() -> Any:
    cup = _cylinder(60, 25) - _cylinder(60, 22, at=(0, 0, 4))
    ring = _cylinder(8, 16, at=(0, 0, -4)) - _cylinder(10, 11, at=(0, 0, -5))
    handle = ring.rotate([90, 0, 0]).translate([30, 0, 30])
    return cup + (handle - _cylinder(80, 23.5, at=(0, 0, -5)))


def _near_symmetric_box() -> Any:
    return _box((60, 40, 25)) - _box((12, 40, 6), (48, 0, 19))


def _pipe_tee() -> Any:
    outer = _cylinder(70, 14).rotate([0, 90, 0]) + _cylinder(35, 14).translate([35, 0, 0])
    inner = _cylinder(90, 11, at=(0, 0, -10)).rotate([0, 90, 0])
    return outer - inner - _cylinder(50, 11).translate([35, 0, 0])


def _chiral_stair() -> Any:
    steps = _box((20, 20, 10)) + _box((20, 20, 20), (20, 0, 0)) + _box((20, 20, 30), (20, 20, 0))
    return steps + _box((20, 20, 40), (40, 20, 0))


PARTS: dict[str, Callable[[], Any]] = {
    "cube": _cube,
    "bar_clamp": _bar_clamp,
    "bracket": _bracket,
    "pawn": _pawn,
    "gear": _gear,
    "keyed_gear": _keyed_gear,
    "mug": _mug,
    "near_symmetric_box": _near_symmetric_box,
    "pipe_tee": _pipe_tee,
    "chiral_stair": _chiral_stair,
}
"""Cubes, clamps, brackets, parts of revolution, toothed, hollow, nearly symmetric, chiral."""
