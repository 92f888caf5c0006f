"""Parts of machines: knobs, gears, fittings, blades. Millimeters."""

from __future__ import annotations

import numpy as np

from collection.objects.solids import (
    Point2,
    Solid,
    arc,
    block,
    plate,
    ring_of,
    rod,
    turned,
    twisted,
)


def knob() -> Solid:
    """A fluted control knob with a flat-sided shaft hole and a pointer."""
    lobes = 9
    outline: list[Point2] = []
    for angle in np.linspace(0, 2 * np.pi, lobes * 12, endpoint=False):
        radius = 17 + 1.4 * np.cos(lobes * angle)
        outline.append((float(radius * np.cos(angle)), float(radius * np.sin(angle))))
    skirt = turned([(0, 0), (20, 0), (20, 3), (17, 6), (0, 6)], 64)
    pointer = block((14, 3, 3), (5, -1.5, 20))
    shaft = rod(3.2, 14, 32, base_mm=(0, 0, -1)) - block((4, 10, 20), (2.2, -5, -3))
    return skirt + plate(outline, 16).translate((0, 0, 5)) + pointer - shaft


def gear() -> Solid:
    """A spur gear of 20 teeth with a hub on one side, a bore and five windows."""
    teeth, root, tip = 20, 18.0, 22.0
    outline: list[Point2] = []
    for k in range(teeth):
        center = 360.0 * k / teeth
        for radius, offset in ((root, -5.4), (20.2, -3.4), (tip, -1.7), (tip, 1.7), (20.2, 3.4)):
            outline += arc((0, 0), radius, center + offset, center + offset, 1)
        outline += arc((0, 0), root, center + 5.4, center + 5.4, 1)
    wheel = plate(outline, 9) + rod(8, 17, 44)
    windows = ring_of(rod(3, 20, 22, base_mm=(12.8, 0, -4)), 5)
    return wheel - windows - rod(4, 30, 40, base_mm=(0, 0, -5))


def mount() -> Solid:
    """A bearing mount: a base with slots, a round head with a bore, two ribs."""
    head = rod(16, 14, 64, base_mm=(0, -7, 28), axis="y")
    neck = block((32, 14, 28), (-16, -7, 0))
    base = block((58, 22, 6), (-29, -11, 0))
    solid = head + neck + base - rod(9, 30, 48, base_mm=(0, -15, 28), axis="y")
    for x in (-23.0, 23.0):
        slot = Solid.batch_hull([rod(2.6, 20, 24, base_mm=(x, y, -5)) for y in (-4, 4)])
        solid = solid - slot
    return solid


def pipe_connector() -> Solid:
    """A T-piece with collars."""
    run, branch = (rod(11, 60, 48, base_mm=(-30, 0, 0), axis="x"), rod(9, 34, 48))
    solid = run + branch
    for x in (-30.0, 22.0):
        solid = solid + rod(14, 8, 48, base_mm=(x, 0, 0), axis="x")
    solid = solid + rod(12, 7, 48, base_mm=(0, 0, 27))
    solid = solid - rod(8, 80, 48, base_mm=(-40, 0, 0), axis="x")
    return solid - rod(6.5, 50, 48)


def turbine() -> Solid:
    """A hub with seven twisted blades and a shroud disk."""
    hub = turned([(0, 0), (9, 0), (8, 14), (5, 22), (0, 24)], 40)
    profile = [(5.0, -1.1), (21.0, -1.1), (21.0, 1.1), (5.0, 1.1)]
    blade = twisted(profile, 15, 38, 9).translate((0, 0, 1))
    disk = rod(22, 2.4, 64)
    return hub + ring_of(blade, 7) + disk - rod(2.5, 40, 24, base_mm=(0, 0, -4))
