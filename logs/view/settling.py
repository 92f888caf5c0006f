"""Predicted settling: ghosts of the part on its way from the first press to where it comes to rest.

A score may tell that way: its text `path` is a JSON list of T_world_object.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence

import numpy as np
import rerun as rr

from logs.record.annotations import ScoreRecord
from logs.view import colors
from logs.view.object import WORLD
from logs.view.stage import Stage, flat_mesh
from reach.arrays import FloatArray
from reach.errors import InvalidInputError
from reach.transforms import as_transform

SETTLING = f"{WORLD}/predicted_settling"
"""One child a model; below it ghosts of the `way`, and of the part once it is `settled`."""
LEAST_APART = 2e-3
"""A part that settles by less at all its corners is drawn nowhere else [m]."""
STEPS = 5
"""So many steps of equal length are drawn at most: more ghosts would only blur."""


def show_settling(
    stage: Stage, scores: Mapping[str, ScoreRecord], triangles: FloatArray | None, time_ns: int
) -> None:
    """Draw where each model lets the part slide while the jaws close.

    Args:
        stage: where.
        scores: newest score of each model.
        triangles: of the part, object frame, shape (F, 3, 3) [m]; None if it has no mesh.
        time_ns: when the jaws begin to close [ns]; the ghosts appear then.
    """
    if triangles is None:
        return
    for model, score in scores.items():
        ghosts = distinct_poses(predicted_path(score), triangles)
        if len(ghosts) > 1:  # one alone would lie in the part itself
            entity = f"{SETTLING}/{model}"
            _show(stage, f"{entity}/way", ghosts[:-1], triangles, time_ns, colors.SETTLING)
            _show(stage, f"{entity}/settled", ghosts[-1:], triangles, time_ns, colors.SETTLED)


def predicted_path(score: ScoreRecord) -> list[FloatArray]:
    """T_world_object from the first press to the settled pose; empty if the score tells none."""
    try:
        return [as_transform(pose) for pose in json.loads(score.texts.get("path", "[]"))]
    except (ValueError, TypeError, InvalidInputError):
        return []  # another model's `path` may be anything


def distinct_poses(path: Sequence[FloatArray], triangles: FloatArray) -> list[FloatArray]:
    """The path without poses that look alike; the last one always stays.

    Args:
        path: T_world_object.
        triangles: of the part, object frame, shape (F, 3, 3) [m].
    """
    if not path:
        return []
    low, high = triangles.min(axis=(0, 1)), triangles.max(axis=(0, 1))
    corners = np.stack(np.meshgrid(*zip(low, high, strict=True)), axis=-1).reshape(-1, 3)
    step = max(_distance(path[0], path[-1], corners) / STEPS, LEAST_APART)
    kept = [path[-1]]
    for T in reversed(path):
        if _distance(T, kept[-1], corners) >= step * (1 - 1e-9):
            kept.append(T)
    return kept[::-1]


def _distance(T_a: FloatArray, T_b: FloatArray, corners: FloatArray) -> float:
    """How far the corner that moves most is moved [m]."""
    change = T_a - T_b
    moved = corners @ change[:3, :3].T + change[:3, 3]
    return float(np.linalg.norm(moved, axis=1).max())


def _show(
    stage: Stage,
    entity: str,
    poses: Sequence[FloatArray],
    triangles: FloatArray,
    time_ns: int,
    color: colors.Color,
) -> None:
    placed = rr.InstancePoses3D(
        translations=[T[:3, 3] for T in poses], mat3x3=[T[:3, :3] for T in poses]
    )
    stage.at(entity, time_ns, flat_mesh(triangles, color), placed)
