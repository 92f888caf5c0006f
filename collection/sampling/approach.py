"""Where the gripper stands for a pair of contacts, and how it comes there."""

from __future__ import annotations

import numpy as np

from collection.sampling.antipodal import ContactPairs
from reach.arrays import BoolArray, FloatArray
from reach.gripper import ParallelJawGripper
from reach.transforms import inverse, make_transform


def center_of_pads(gripper: ParallelJawGripper) -> FloatArray:
    """Pose (4, 4) of the point halfway between the pads' origins, gripper frame and axes."""
    origins = [gripper.T_gripper_pad(jaw)[:3, 3] for jaw in range(len(gripper.jaws))]
    return make_transform(None, np.mean(origins, axis=0))


def tip_reach(gripper: ParallelJawGripper) -> float:
    """How far the pads reach beyond their origin toward the finger tips [m]."""
    return float(min(jaw.pad.polygon[:, 0].max() for jaw in gripper.jaws))


def draw_approaches(
    axes: FloatArray, down: FloatArray, limit: float, rng: np.random.Generator
) -> tuple[FloatArray, BoolArray]:
    """Approach directions uniform about each closing axis within an angle of straight down.

    Args:
        axes: closing axes, unit, shape (N, 3), object frame.
        down: straight down in the object's frame, unit, shape (3,).
        limit: largest angle between approach and down [rad].
        rng: source of randomness.

    Returns:
        Unit directions (N, 3), and where there is any, shape (N,).
    """
    flat = down - (axes @ down)[:, None] * axes  # the way closest to straight down
    steepness = np.linalg.norm(flat, axis=1)
    possible = steepness >= np.cos(limit)
    best = flat / np.where(possible, steepness, 1.0)[:, None]
    widest = np.arccos(np.clip(np.cos(limit) / np.where(possible, steepness, 1.0), -1, 1))
    turn = (2 * rng.random(len(axes)) - 1) * widest
    side = np.cross(axes, best)
    return np.cos(turn)[:, None] * best + np.sin(turn)[:, None] * side, possible


def gripper_poses(
    pairs: ContactPairs, approaches: FloatArray, gripper: ParallelJawGripper
) -> FloatArray:
    """Poses T_object_gripper (N, 4, 4) that put the middle of each pair between the pads."""
    T_object_center = np.tile(np.eye(4), (len(approaches), 1, 1))
    x, z = pairs.axes, approaches
    T_object_center[:, :3, 0] = x
    T_object_center[:, :3, 1] = np.cross(z, x)
    T_object_center[:, :3, 2] = z
    T_object_center[:, :3, 3] = pairs.points.mean(axis=1)
    poses: FloatArray = T_object_center @ inverse(center_of_pads(gripper))
    return poses


def drawn_back(
    T_object_gripper: FloatArray, shortage: FloatArray, down: FloatArray, limit: float
) -> FloatArray:
    """Draw the hand back along its approach where its tips would sink into the table.

    Args:
        T_object_gripper: poses, shape (N, 4, 4).
        shortage: height that is missing, shape (N,) [m]; nothing happens where not positive.
        down: straight down in the object's frame, shape (3,).
        limit: largest way back [m]; poses that need more stay where they are.
    """
    approach = T_object_gripper[:, :3, 2]
    back = np.maximum(shortage, 0) / (approach @ down)
    back = np.where(back <= limit, back, 0.0)
    result = T_object_gripper.copy()
    result[:, :3, 3] -= back[:, None] * approach
    return result


def jittered(T_object_gripper: FloatArray, width: float, rng: np.random.Generator) -> FloatArray:
    """Move each pose by U(-width/2, width/2) along each axis of the gripper [m]."""
    offsets = (rng.random((len(T_object_gripper), 3)) - 0.5) * width
    result = T_object_gripper.copy()
    result[:, :3, 3] += np.einsum("nij,nj->ni", T_object_gripper[:, :3, :3], offsets)
    return result
