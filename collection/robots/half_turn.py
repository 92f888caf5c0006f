"""A parallel-jaw grasp held alike: the same one, half a turn about the approach axis.

If the hand's pads change places under that turn, both grasps press the same pads on the same
places of the part, and the arm may take whichever it reaches.
"""

from __future__ import annotations

import numpy as np

from reach.arrays import FloatArray, frozen
from reach.gripper import Jaw, ParallelJawGripper
from reach.transforms import make_transform, rotation_about

HALF_TURN = make_transform(rotation_about((0.0, 0.0, 1.0), np.pi))
SAME_PLACE = 1e-4
"""Pads that differ by less are the same: in position and outline [m], in direction [rad]."""


def held_alike(gripper: ParallelJawGripper, T_world_gripper: FloatArray) -> FloatArray:
    """Poses of the hand that hold a part as a given one does, that one first.

    Args:
        gripper: the hand.
        T_world_gripper: the grasp, shape (4, 4).

    Returns:
        Shape (2, 4, 4); (1, 4, 4) if half a turn would press other pads on the part.
    """
    poses = [np.asarray(T_world_gripper)]
    if pads_change_places(gripper):
        poses.append(poses[0] @ HALF_TURN)
    return frozen(poses)


def pads_change_places(gripper: ParallelJawGripper) -> bool:
    """Whether half a turn about the approach axis puts every pad where an equal one was."""
    return all(any(_replaces(jaw, other) for other in gripper.jaws) for jaw in gripper.jaws)


def _replaces(jaw: Jaw, other: Jaw) -> bool:
    turned = HALF_TURN @ jaw.T_gripper_pad_open
    same_face = np.allclose(turned, other.T_gripper_pad_open, atol=SAME_PLACE, rtol=0)
    return same_face and _same_outline(jaw.pad.polygon, other.pad.polygon)


def _same_outline(polygon: FloatArray, other: FloatArray) -> bool:
    """Whether two outlines (N, 2) have the same corners, whichever comes first."""
    if len(polygon) != len(other):
        return False
    return any(
        np.allclose(np.roll(polygon, shift, axis=0), other, atol=SAME_PLACE, rtol=0)
        for shift in range(len(polygon))
    )
