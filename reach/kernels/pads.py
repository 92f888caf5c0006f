"""A gripper's pads as the kernels see them."""

from __future__ import annotations

from functools import lru_cache
from typing import NamedTuple

import numpy as np

from reach.arrays import FloatArray
from reach.gripper import Pad, ParallelJawGripper


class Pads(NamedTuple):
    """The prisms that the pads sweep, one row a jaw.

    Attributes:
        T_gripper_pad: fully open, shape (J, 4, 4).
        edges: half-planes a x + b y <= c of each outline, shape (J, K, 3), unit (a, b); rows of
            zeros fill up pads with fewer corners.
        boxes: x_min, x_max, y_min, y_max of each outline, shape (J, 4) [m].
        ends: where the search along the closing direction begins and ends, shape (J, 2) [m].
        max_deformation: shape (J,) [m].
    """

    T_gripper_pad: FloatArray
    edges: FloatArray
    boxes: FloatArray
    ends: FloatArray
    max_deformation: FloatArray


@lru_cache(maxsize=64)
def pads_of(gripper: ParallelJawGripper, opening: float | None = None) -> Pads:
    """Describe a gripper's pads for the kernels.

    The search starts one deformation limit behind the face of the opened pad, because a soft pad
    that just touches the part when the hand comes down gives way, and it ends where a jaw that
    travels the whole opening arrives: the part need not sit in the middle.

    Args:
        gripper: any number of jaws.
        opening: distance of the pads before closing [m]; fully open if None.
    """
    jaws = gripper.jaws
    most = max(len(jaw.pad.polygon) for jaw in jaws)
    edges = np.zeros((len(jaws), most, 3))
    boxes = np.zeros((len(jaws), 4))
    for index, jaw in enumerate(jaws):
        planes = outline_half_planes(jaw.pad)
        edges[index, : len(planes)] = planes
        low, high = jaw.pad.polygon.min(axis=0), jaw.pad.polygon.max(axis=0)
        boxes[index] = low[0], high[0], low[1], high[1]
    limits = np.array([jaw.pad.max_deformation for jaw in jaws])
    travel = gripper.travel(opening)
    ends = np.column_stack([travel - limits, np.full(len(jaws), gripper.max_opening)])
    T_gripper_pad = np.array([jaw.T_gripper_pad_open for jaw in jaws])
    return Pads(T_gripper_pad, edges, boxes, ends, limits)


def outline_half_planes(pad: Pad) -> FloatArray:
    """Half-planes a x + b y <= c that bound a pad's outline, rows (a, b, c), shape (N, 3)."""
    sides = np.roll(pad.polygon, -1, axis=0) - pad.polygon
    normals = np.column_stack([sides[:, 1], -sides[:, 0]])
    lengths = np.linalg.norm(normals, axis=1)
    normals = normals[lengths > 0] / lengths[lengths > 0, None]
    offsets = np.einsum("ij,ij->i", normals, pad.polygon[lengths > 0])
    return np.column_stack([normals, offsets])
