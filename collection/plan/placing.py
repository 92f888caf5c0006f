"""What the operator who places a part is told and shown."""

from __future__ import annotations

import numpy as np

from collection.pictures import View, part_picture, png_bytes
from collection.plan.records import PlannedPose
from reach.arrays import FloatArray
from reach.objects import GraspObject
from reach.transforms import apply

_ON_TABLE = 5e-4
"""Vertices this low touch the table [m]."""
_TOUCH = {1: "one point", 2: "two points", 3: "three points"}


def how_it_lies(obj: GraspObject, pose: PlannedPose) -> str:
    """Size over the table and the support of a part in a pose."""
    points = apply(pose.T_world_object, obj.vertices)
    long, short = _footprint(points[:, :2])
    height = float(points[:, 2].max())
    return (
        f"{height * 1e3:.0f} mm high, {long * 1e3:.0f} x {short * 1e3:.0f} mm seen from above, "
        f"resting on {_support(points)}"
    )


def placing_picture(obj: GraspObject, pose: PlannedPose, view: View | None = None) -> bytes:
    """PNG file of a part as it has to lie, on a grid of 10 mm."""
    return png_bytes(part_picture(obj, pose.T_world_object, view))


def _footprint(points: FloatArray) -> tuple[float, float]:
    """Longer and shorter side [m] of the tightest rectangle about points (N, 2)."""
    from scipy.spatial import ConvexHull

    outline = points[ConvexHull(points).vertices]
    edges = np.roll(outline, -1, axis=0) - outline
    best = (np.inf, np.inf)
    for angle in np.arctan2(edges[:, 1], edges[:, 0]):
        turn = np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])
        sides = np.ptp(outline @ turn.T, axis=0)
        if sides.prod() < best[0] * best[1]:
            best = (float(sides.max()), float(sides.min()))
    return best


def _support(points: FloatArray) -> str:
    """In words, what touches the table."""
    touching = points[points[:, 2] <= _ON_TABLE, :2]
    spread = np.linalg.svd(touching - touching.mean(axis=0), compute_uv=False)
    if spread[0] < 1e-3:
        return "one point"
    if len(spread) < 2 or spread[1] < 1e-3:
        return "a line"
    return _TOUCH.get(len(touching), f"an area of {_size(touching)}")


def _size(points: FloatArray) -> str:
    long, short = _footprint(points)
    return f"{long * 1e3:.0f} x {short * 1e3:.0f} mm"
