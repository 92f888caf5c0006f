"""Where a search starts: orientations of the part, each put where its visible side was seen."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from reach.arrays import FloatArray
from reach.stable_poses import StablePose
from reach.transforms import make_transform, rotation_about
from registration.mesh_model import MeshModel
from registration.observation import Observation
from registration.rendering import render, visible_centroids

YAWS = 72
"""Turns about the table's normal tried for each stable pose."""
PLACINGS = 3
START_PIXELS = 18
"""Resolution at which starts are rendered: pixels across the part's diameter."""
ROTATIONS = 1600
"""Orientations tried when the part may lie in any way."""


def planar_starts(poses: Sequence[StablePose]) -> FloatArray:
    """Every stable pose at every yaw, shape (len(poses) * YAWS, 4, 4), table frame."""
    turns = np.stack(
        [rotation_about((0, 0, 1), angle) for angle in np.arange(YAWS) * 2 * np.pi / YAWS]
    )
    starts = np.zeros((len(poses), YAWS, 4, 4))
    starts[..., 3, 3] = 1.0
    for i, pose in enumerate(poses):
        for j in range(3):
            for k in range(4):
                starts[i, :, j, k] = (turns[:, j, :] * pose.T_world_object[:3, k]).sum(axis=1)
    return starts.reshape(-1, 4, 4)


def free_starts(center: FloatArray) -> FloatArray:
    """Rotations spread evenly over all orientations, shape (ROTATIONS, 4, 4).

    They follow a super-Fibonacci spiral on the unit quaternions ([Alexa2022]).

    Args:
        center: point of the object that is put at the origin, shape (3,), object frame [m].
    """
    psi = 1.533751168755204288118041
    s = np.arange(ROTATIONS) + 0.5
    r, big_r = np.sqrt(s / ROTATIONS), np.sqrt(1 - s / ROTATIONS)
    alpha, beta = 2 * np.pi * s / np.sqrt(2), 2 * np.pi * s / psi
    x, y = r * np.sin(alpha), r * np.cos(alpha)
    z, w = big_r * np.sin(beta), big_r * np.cos(beta)
    starts = np.zeros((ROTATIONS, 4, 4))
    starts[:, 0, :3] = np.stack(
        [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)], axis=1
    )
    starts[:, 1, :3] = np.stack(
        [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)], axis=1
    )
    starts[:, 2, :3] = np.stack(
        [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)], axis=1
    )
    starts[:, :3, 3] = -(starts[:, :3, :3] * center).sum(axis=2)
    starts[:, 3, 3] = 1.0
    return starts


def turned_over(T: FloatArray, center: FloatArray) -> FloatArray:
    """Poses (N, 4, 4) turned by quarter and half turns about the object's axes, (N * 9, 4, 4).

    Args:
        T: poses in any frame, shape (N, 4, 4).
        center: point of the object that stays in place, shape (3,), object frame [m].
    """
    result = []
    for pose in T:
        for axis in np.eye(3):
            for quarter in (1, 2, 3):
                turn = rotation_about(axis, quarter * np.pi / 2)
                result.append(pose @ make_transform(turn, center - turn @ center))
    return np.stack(result)


def put_where_seen(
    model: MeshModel,
    seen: Observation,
    T_camera_object: FloatArray,
    centroid_camera: FloatArray,
    slide: FloatArray | None,
) -> FloatArray:
    """Shift starts so that the visible side's centroid falls on the observed one.

    The centroid of the whole model would be off by up to half its size, and so would be that
    of its facing points on a hollow part; the starts are therefore rendered, coarsely.

    Args:
        model: of the part.
        seen: the image's window.
        T_camera_object: starts, shape (N, 4, 4).
        centroid_camera: mean of the observed points, shape (3,), camera frame [m].
        slide: the table's normal, shape (3,), camera frame, if the part may slide only along
            the table; None if it may move freely.

    Returns:
        The shifted starts, shape (N, 4, 4).
    """
    stride = _stride(model, seen, float(centroid_camera[2]))
    result = T_camera_object.copy()
    for _ in range(PLACINGS):  # what hides the part changes as it moves
        rendered = render(model, seen, result, seen.rays(stride), stride)
        centroids = visible_centroids(seen, rendered, stride, result[:, :3, 3])
        shift = centroid_camera - centroids
        if slide is not None:
            shift = shift - (shift * slide).sum(axis=1)[:, None] * slide
        result[:, :3, 3] += shift
    return result


def _stride(model: MeshModel, seen: Observation, distance: float) -> int:
    """Stride at which the part's diameter spans START_PIXELS pixels."""
    across = model.obj.diameter * seen.frame.intrinsics.fx / distance
    return max(1, int(across / START_PIXELS))
