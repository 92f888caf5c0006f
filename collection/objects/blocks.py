"""Parts that could be milled or laser-cut: flat faces, edges, holes. Millimeters."""

from __future__ import annotations

import numpy as np

from collection.objects.solids import Point2, Solid, arc, block, plate, rod


def cube_3cm() -> Solid:
    """A plain 30 mm cube."""
    return block((30, 30, 30), (-15, -15, -15))


def near_cube() -> Solid:
    """A box of 28 x 30 x 33 mm, which is easily taken for a cube."""
    return block((28, 30, 33), (-14, -15, -16.5))


def wedge() -> Solid:
    """A 16-degree ramp with a blunt tip: most pairs of its faces are not parallel."""
    return plate([(0, 0), (52, 0), (52, 5), (0, 20)], 26).rotate((90, 0, 0))


def bracket() -> Solid:
    """An angle bracket with one off-center rib, two holes below and one above."""
    solid = block((50, 24, 5)) + block((5, 24, 38))
    rib = plate([(4, 4), (30, 4), (4, 28)], 4).rotate((90, 0, 0)).translate((0, 10, 0))
    solid = solid + rib
    for x in (22, 40):
        solid = solid - rod(3, 10, 24, base_mm=(x, 17, -2))
    return solid - rod(4, 10, 28, base_mm=(-2, 12, 28), axis="x")


def perforated_plate() -> Solid:
    """A thin plate, 60 x 38 x 4 mm, with twelve holes of two sizes."""
    solid = block((60, 38, 4))
    for i in range(4):
        for j in range(3):
            radius = 3.5 if (i + j) % 2 else 2.2
            solid = solid - rod(radius, 8, 24, base_mm=(9 + 14 * i, 7 + 12 * j, -2))
    return solid


def star() -> Solid:
    """A five-pointed star, 18 mm thick, points rounded."""
    outline: list[Point2] = []
    for k in range(5):
        tip, valley = 90 + 72 * k, 90 + 72 * k + 36
        center = (21 * np.cos(np.radians(tip)), 21 * np.sin(np.radians(tip)))
        outline += arc((float(center[0]), float(center[1])), 2.0, tip - 60, tip + 60, 9)
        outline += arc((0, 0), 11.0, valley, valley, 1)
    return plate(outline, 18)


def hook() -> Solid:
    """A coat hook: a drilled back plate and an arm that curls up to a ball."""
    back = block((30, 5, 46), (-15, -5, 0))
    for z in (8, 38):
        back = back - rod(2.5, 12, 20, base_mm=(0, -8, z), axis="y")
    path = [(0.0, 18.0), (10.0, 15.5), *arc((18, 23), 11, 250, 390, 8), (28.5, 36.0)]
    knots = [rod(4.2, 9, 20, base_mm=(-4.5, y, z), axis="x") for y, z in path]
    arm = knots[0]
    for first, second in zip(knots, knots[1:], strict=False):
        arm = arm + Solid.batch_hull([first, second])
    ball = Solid.sphere(6.5, 28).translate((0, 28.5, 37))
    return back + arm + ball


def clamp() -> Solid:
    """A C-clamp's frame with a screw boss and an anvil."""
    frame = block((16, 58, 62), (-8, 0, 0)) - block((20, 38, 40), (-10, 12, 11))
    boss = rod(9, 14, 40, base_mm=(0, 46, 60))
    anvil = rod(7, 6, 40, base_mm=(0, 42, 10))
    solid = frame + boss + anvil - rod(3.5, 40, 28, base_mm=(0, 46, 45))
    return solid - block((24, 20, 22), (-12, 48, 22))
