"""How much of the pads meets the object: a score without any physics.

Rays leave a pad's face along its closing direction on a 1 mm grid; the cells whose ray meets
the object within the pad's deformation of the nearest one would be pressed in. The score is the
pressed share of the pad, of the jaw that has less of it, averaged over perturbed poses.
"""

from __future__ import annotations

from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np

from reach.arrays import FloatArray, frozen
from reach.grasp import Grasp
from reach.gripper import Pad, ParallelJawGripper
from reach.objects import GraspObject
from reach.raycast import RaycastScene
from reach.scene import Scene
from reach.transforms import inverse

if TYPE_CHECKING:
    from reach.pose_error import PoseError

CELL = 1e-3
"""Pitch of the grid of rays [m]."""

START_BEHIND = 11e-3
"""Rays start this far behind the open pad's face, a finger's thickness [m].

A part that lies off-center along the closing axis is pushed by the opening finger; a ray that
started on the pad's nominal face would begin inside it and miss it.
"""


def overlap_score(
    scene: Scene,
    grasp: Grasp,
    *,
    pose_error: PoseError | None,
    samples: int = 30,
    seed: int = 0,
) -> float:
    """Share of the pad that would touch the object, in [0, 1].

    Args:
        scene: object and gripper.
        grasp: the planned grasp.
        pose_error: of the object, in its own frame; the planned pose alone if None.
        samples: number of perturbed poses.
        seed: of the perturbations.
    """
    T_gripper_object = inverse(grasp.T_object_gripper)[None]
    if pose_error is not None:
        rng = np.random.default_rng(seed)
        T_gripper_object = pose_error.perturb(T_gripper_object[0], rng, samples)
    T_object_gripper = inverse(np.asarray(T_gripper_object))
    shares = [
        pressed_shares(scene.object, scene.gripper, jaw, T_object_gripper, grasp.opening)
        for jaw in range(len(scene.gripper.jaws))
    ]
    return float(np.min(shares, axis=0).mean())


def pressed_shares(
    part: GraspObject,
    gripper: ParallelJawGripper,
    jaw: int,
    T_object_gripper: FloatArray,
    opening: float | None = None,
) -> FloatArray:
    """Share of a jaw's pad that the object presses in.

    Args:
        part: the object.
        gripper: the hand.
        jaw: index of the jaw.
        T_object_gripper: poses of the gripper, shape (N, 4, 4).
        opening: of the jaws before closing [m]; fully open if None.

    Returns:
        Shape (N,).
    """
    depth = _depths(part, gripper, jaw, T_object_gripper, opening)
    nearest = depth.min(axis=1, keepdims=True)
    limit = gripper.jaws[jaw].pad.max_deformation
    shares: FloatArray = (np.isfinite(depth) & (depth <= nearest + limit)).mean(axis=1)
    return shares


def closed_width(
    part: GraspObject,
    gripper: ParallelJawGripper,
    T_object_gripper: FloatArray,
    opening: float | None = None,
) -> float | None:
    """Distance of the two pads when both touch the undeformed object [m].

    Args:
        part: the object.
        gripper: a hand with two jaws.
        T_object_gripper: shape (4, 4).
        opening: of the jaws before closing [m]; fully open if None.

    Returns:
        None if a pad meets nothing.
    """
    travels = [
        float(_depths(part, gripper, jaw, T_object_gripper[None], opening).min()) for jaw in (0, 1)
    ]
    start = gripper.max_opening if opening is None else opening
    width = start - sum(travels)
    return width if np.isfinite(width) and width > 0 else None


def _depths(
    part: GraspObject,
    gripper: ParallelJawGripper,
    jaw: int,
    T_object_gripper: FloatArray,
    opening: float | None,
) -> FloatArray:
    """Distance from each cell of the pad to the object, shape (N, C) [m].

    Infinite where the ray meets nothing, or a face from behind; negative where the object is
    behind the pad's nominal face.
    """
    pad = gripper.jaws[jaw].pad
    cells = _cells(pad)
    T_object_pad = T_object_gripper @ gripper.T_gripper_pad(jaw, opening)
    direction = T_object_pad[:, :3, 2]
    origins = np.einsum("nij,cj->nci", T_object_pad[:, :3, :2], cells)
    origins += (T_object_pad[:, :3, 3] - START_BEHIND * direction)[:, None]
    directions = np.broadcast_to(direction[:, None], origins.shape)
    depth, face = _raycast_scene(part).cast(origins.reshape(-1, 3), directions.reshape(-1, 3))
    depth, face = depth.reshape(origins.shape[:2]), face.reshape(origins.shape[:2])
    facing = np.einsum("nci,ni->nc", part.face_normals[face], direction) < 0
    across = START_BEHIND + 2.0 * gripper.stroke  # to the other side of the hand
    depths: FloatArray = np.where(facing & (depth <= across), depth - START_BEHIND, np.inf)
    return depths


@lru_cache(maxsize=8)
def _cells(pad: Pad) -> FloatArray:
    """Centers of the grid cells inside the pad's outline, shape (C, 2), pad x, y [m]."""
    low, high = pad.polygon.min(axis=0), pad.polygon.max(axis=0)
    axes = [
        np.arange(a + CELL / 2, b, CELL) if b - a > CELL else np.array([(a + b) / 2])
        for a, b in zip(low, high, strict=True)
    ]
    grid = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 2)
    edges = np.roll(pad.polygon, -1, axis=0) - pad.polygon
    offset = grid[:, None] - pad.polygon
    left_of_edge = edges[:, 0] * offset[..., 1] - edges[:, 1] * offset[..., 0] >= 0
    return frozen(grid[left_of_edge.all(axis=1)])


@lru_cache(maxsize=4)
def _raycast_scene(part: GraspObject) -> RaycastScene:
    return RaycastScene(part.vertices, part.faces)
