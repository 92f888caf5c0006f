"""Colors of the views: quiet surroundings, the object and what is predicted stand out."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from reach.arrays import FloatArray

Color = tuple[int, int, int, int]

TABLE: Color = (92, 96, 104, 255)
LINK: Color = (205, 208, 214, 255)
JOINTED: Color = (150, 156, 168, 255)
PALM: Color = (88, 94, 106, 255)
FINGER: Color = (112, 119, 133, 255)
PAD: Color = (244, 162, 54, 255)
OBJECT: Color = (86, 148, 214, 255)
OBJECT_GLASS: Color = (86, 148, 214, 60)
TRUTH: Color = (98, 190, 120, 110)
RIVAL: Color = (196, 120, 200, 70)
SETTLING: Color = (255, 120, 110, 255)
SETTLED: Color = (255, 120, 110, 75)
PLANNED: Color = (250, 224, 94, 255)
FORCE: Color = (255, 255, 255, 255)
BACKGROUND: Color = (24, 27, 33, 255)

_ANCHORS = np.array(
    [
        (13, 8, 135),
        (84, 2, 163),
        (139, 10, 165),
        (185, 50, 137),
        (219, 92, 104),
        (244, 136, 73),
        (254, 188, 43),
        (240, 249, 33),
    ],
    dtype=float,
)
"""Eight steps of the perceptually uniform "plasma" scale: dark violet is low, yellow is high."""


def pressure_colors(pressures: FloatArray, highest: float) -> NDArray[np.uint8]:
    """Colors of pressures from zero to the highest, shape (..., 3)."""
    share = np.clip(pressures / highest if highest > 0 else np.zeros_like(pressures), 0, 1)
    place = share * (len(_ANCHORS) - 1)
    low = np.minimum(place.astype(int), len(_ANCHORS) - 2)
    between = (place - low)[..., None]
    mixed = _ANCHORS[low] * (1 - between) + _ANCHORS[low + 1] * between
    shades: NDArray[np.uint8] = np.rint(mixed).astype(np.uint8)
    return shades


def faded(color: Color, share: float) -> Color:
    """A color of which only a share is left against the table's."""
    mixed = [round(share * c + (1 - share) * t) for c, t in zip(color, TABLE, strict=True)]
    return mixed[0], mixed[1], mixed[2], 255
