"""A pad as a bed of pins: an elastic foundation made discrete."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from reach.arrays import FloatArray, frozen
from reach.gripper import Pad

GRID = (7, 5)
"""Pins along and across the approach direction."""
SMALLEST_CELL = 0.05
"""A cell that keeps less than this share of its area gets no pin."""


@dataclass(frozen=True, slots=True, eq=False)
class PinBed:
    """Where a pad's pins stand and which area each carries.

    Args:
        centers: pad frame x, y, shape (P, 2) [m].
        areas: shape (P,) [m^2]; they add up to the pad's area.
        radius: of a pin's round head [m].
    """

    centers: FloatArray
    areas: FloatArray
    radius: float


def pin_bed(pad: Pad, grid: tuple[int, int] = GRID) -> PinBed:
    """Cover a pad's face with a grid of cells clipped to its outline, one pin a cell.

    A pin stands at its clipped cell's centroid, so that a uniform pressure has the right
    resultant and the outline's cut corners the right weight.
    """
    from shapely import Polygon, box

    outline = Polygon(pad.polygon)
    low, high = pad.polygon.min(axis=0), pad.polygon.max(axis=0)
    xs, ys = (np.linspace(low[k], high[k], grid[k] + 1) for k in range(2))
    cells = [
        outline.intersection(box(xs[i], ys[j], xs[i + 1], ys[j + 1]))
        for i in range(grid[0])
        for j in range(grid[1])
    ]
    whole = (xs[1] - xs[0]) * (ys[1] - ys[0])
    kept = [cell for cell in cells if cell.area > SMALLEST_CELL * whole]
    areas = np.array([cell.area for cell in kept])
    centers = [(cell.centroid.x, cell.centroid.y) for cell in kept]
    return PinBed(
        frozen(centers), frozen(areas * pad.area / areas.sum()), 0.5 * float(ys[1] - ys[0])
    )
