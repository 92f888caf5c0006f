"""Where a simulated operator puts a part down: where its grasp is reached, with room for error."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING

import numpy as np

from collection.robots.motion import can_execute
from reach.arrays import FloatArray
from reach.transforms import make_transform, rotation_about

if TYPE_CHECKING:
    from collection.station.station import Station

SHIFT, TURN = 2e-3, float(np.radians(2.0))
"""What settling and registration may add to a placement [m], [rad]."""


def well_placed(
    station: Station, grasps_of: Callable[[FloatArray], FloatArray], T_world_object: FloatArray
) -> bool:
    """Whether the arm executes a part's grasp here, and where it may be believed to be.

    The session tries the grasp at the registered pose of the settled part, not at this one. What
    this costs: parts lie a little away from the limits of reach, more often than at random. A
    person does the same; only positions and turns are affected, never the grasp on the part.

    Args:
        station: connected.
        grasps_of: T_world_gripper (K, 4, 4) of grasps that hold alike, for a T_world_object.
        T_world_object: the placement, shape (4, 4).
    """
    arm, motion = station.arm, station.config.motion
    places = [*_neighbors(T_world_object), T_world_object]
    return all(can_execute(arm, grasps_of(T), motion) for T in places)


def _neighbors(T_world_object: FloatArray) -> Iterator[FloatArray]:
    """The placement shifted and turned to either side."""
    origin = T_world_object[:3, 3]
    for x, y, side in ((1, 1, 1), (1, -1, -1), (-1, 1, -1), (-1, -1, 1)):
        turn = rotation_about((0.0, 0.0, 1.0), side * TURN)
        shift = np.array([x * SHIFT, y * SHIFT, 0.0]) / np.sqrt(2.0)
        yield make_transform(turn, origin + shift - turn @ origin) @ T_world_object
