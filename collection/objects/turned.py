"""Parts from the lathe or the potter's wheel. Millimeters."""

from __future__ import annotations

from collection.objects.solids import Solid, arc, rod, smooth, turned


def cylinder() -> Solid:
    """A round bar, 26 mm thick and 52 mm long."""
    return rod(13, 52, 64)


def egg() -> Solid:
    """A hen's egg at three quarters of its size: nowhere flat."""
    blunt = arc((0, 0), 17, -90, 0, 10)
    point = smooth([(17, 0), (15.6, 8), (11.4, 16.5), (5.2, 22.6), (0, 24.5)], 13)
    return turned([*blunt, *point[1:]], 36)


def pawn() -> Solid:
    """A chess pawn: a foot, a waist, a collar, a ball."""
    foot = [(0.0, 0.0), (14.0, 0.0), (14.0, 4.0)]
    waist = smooth([(12.5, 6), (8.5, 14), (6.2, 24), (5.8, 32)], 9)
    collar = [(9.5, 34.0), (9.5, 36.5), (6.0, 38.0)]
    ball = arc((0, 46), 10, -52, 90, 14)
    return turned([*foot, *waist, *collar, *ball], 48)


def vase() -> Solid:
    """A bulging vase with a narrow neck and a 2.4 mm wall."""
    outside = smooth([(13, 0), (19, 10), (21, 24), (15, 42), (9, 54), (12, 64)], 17)
    inside = smooth([(9.6, 64), (6.6, 54), (12.6, 42), (18.6, 24), (16.6, 10), (11, 3)], 17)
    return turned([(0.0, 0.0), *outside, *inside, (0.0, 3.0)], 46)


def nozzle() -> Solid:
    """A garden-hose nozzle: a hexagonal nut, a flange, a cone with a bore."""
    hexagon = rod(18, 12, 6)
    body = turned([(0, 8), (15, 12), (15, 16), (11, 18), (9, 34), (5.5, 52), (0, 52)], 54)
    return (
        hexagon + body - rod(6, 34, 40, base_mm=(0, 0, -1)) - rod(2.6, 80, 28, base_mm=(0, 0, -1))
    )


def bowl() -> Solid:
    """A shallow bowl on a foot ring, 76 mm wide: held by its wall only."""
    outside = arc((0, 40), 38, -62, 0, 14)
    inside = arc((0, 40), 35, 0, -90, 18)
    foot = [(0.0, 1.5), (11.0, 1.5), (11.0, 0.0), (15.0, 0.0)]
    return turned([*foot, *outside, *inside], 42)


def cup() -> Solid:
    """A thin-walled tapered cup, 1.2 mm, that fits between the jaws."""
    return turned([(0, 0), (16, 0), (21, 56), (19.8, 56), (14.9, 1.2), (0, 1.2)], 72)


def mug() -> Solid:
    """A mug with a square-cut handle."""
    body = turned([(0, 0), (21, 0), (22, 3), (22, 52), (19.5, 52), (19.5, 3), (0, 3)], 72)
    ring = turned([(11, -4), (17, -4), (17, 4), (11, 4)], 40).rotate((90, 0, 0))
    handle = ring.translate((22, 0, 27)) - rod(20.5, 60, 72, base_mm=(0, 0, -2))
    return body + handle
