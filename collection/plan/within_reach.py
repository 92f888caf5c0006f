"""Which planned grasps the arm can reach at all, wherever and however the part is put down.

A plan knows how a part rests, not where: the operator may turn it. A grasp counts as reachable
if the arm reaches it, with approach and lift, at the workspace's center for one of some turns.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np

from reach.arrays import BoolArray, FloatArray
from reach.transforms import make_transform, rotation_about

if TYPE_CHECKING:
    from collection.station.station import Station

TURNS = 8
"""Turns of the part about the vertical that are tried, evenly over the circle."""


def reach_of(station: Station) -> Callable[[FloatArray], BoolArray]:
    """Make the filter that planning asks: T_world_gripper (N, 4, 4) -> (N,) bool.

    The part stands at the world's origin there, as in its stable poses; here it is moved to the
    workspace and turned.
    """
    from collection.robots.motion import reachable_grasps

    area = station.config.workspace
    center = (*area.center, area.table_height)
    placements = [
        make_transform(rotation_about((0, 0, 1), angle), center)
        for angle in np.arange(TURNS) * 2 * np.pi / TURNS
    ]

    def reachable(T_origin_gripper: FloatArray) -> BoolArray:
        found = np.zeros(len(T_origin_gripper), dtype=bool)
        for T_world_origin in placements:
            open_ = np.flatnonzero(~found)
            if len(open_) == 0:
                break
            T_world_gripper = T_world_origin @ T_origin_gripper[open_]
            found[open_] = reachable_grasps(station.arm, T_world_gripper, station.config.motion)
        return found

    return reachable
