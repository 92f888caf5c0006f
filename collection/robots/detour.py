"""A way between two configurations when the straight one touches something."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from collection.errors import UnsafeMotionError
from collection.robots.planner import ArmPlanner, JointPath
from reach.arrays import FloatArray

RANDOM_VIAS = 200
SPREAD = 0.6
"""How far random intermediate configurations lie from the straight way [rad]."""


def detour(planner: ArmPlanner, start: FloatArray, end: FloatArray) -> list[JointPath]:
    """One or two straight motions in joint space that touch nothing.

    Tried in turn: the straight way; some joints first, the others after them; random
    intermediate configurations about the straight way, drawn from a fixed seed.

    Args:
        planner: knows limits and contacts.
        start: shape (J,) [rad].
        end: shape (J,) [rad].

    Raises:
        UnsafeMotionError: none was found; carries what the straight way would touch.
    """
    try:
        return [planner.joint_path(start, end)]
    except UnsafeMotionError as error:
        straight = error
    for via in _vias(planner, start, end):
        try:
            return [planner.joint_path(start, via), planner.joint_path(via, end)]
        except UnsafeMotionError:
            continue
    raise UnsafeMotionError(f"{straight}; no way around it was found")


def _vias(planner: ArmPlanner, start: FloatArray, end: FloatArray) -> Iterator[FloatArray]:
    order = np.arange(len(start))
    for count in range(1, len(start)):
        yield np.where(order < count, end, start)  # the shoulder first
        yield np.where(order >= count, end, start)  # the wrist first
    rng = np.random.default_rng(0)
    chain = planner.arm.chain
    for share in rng.uniform(0.1, 0.9, RANDOM_VIAS):
        about = start + share * (end - start)
        yield np.clip(about + rng.normal(0.0, SPREAD, len(start)), chain.lower, chain.upper)
