"""Predicted settling: ghosts of the part on its way from the first press to where it comes to rest.

The way is drawn as outlines, brighter toward its end, and only the end as a body: bodies on the way
would lie in one another and hide where it leads.

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
from logs.view.outline import outline
from logs.view.stage import Stage, flat_mesh, placed
from reach.arrays import FloatArray
from reach.errors import InvalidInputError
from reach.transforms import as_transform

SETTLING = f"{WORLD}/predicted_settling"
"""One child a model; below it ghosts of the `way`, and of the part once it is `settled`."""
LEAST_APART = 2e-3
"""A part that settles by less at all its corners is drawn nowhere else [m]."""
STEPS = 5
"""So many steps of equal length are drawn at most: more ghosts would only blur."""
WIDTH = 2e-4
"""Radius of the outlines [m]."""


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
            way = _outlines(ghosts[:-1], outline(triangles, ghosts[0][2, :3]))
            stage.at(f"{SETTLING}/{model}/way", time_ns, way)
            settled = flat_mesh(triangles, colors.SETTLED)
            stage.at(f"{SETTLING}/{model}/settled", time_ns, settled, placed(ghosts[-1]))


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


def _outlines(poses: Sequence[FloatArray], edges: FloatArray) -> rr.LineStrips3D:
    """A part's edges (E, 2, 3), object frame, in each of its poses."""
    strips = [edges @ T[:3, :3].T + T[:3, 3] for T in poses]
    shades = [colors.faded(colors.SETTLING, (i + 1) / len(poses)) for i in range(len(poses))]
    return rr.LineStrips3D(
        np.concatenate(strips), colors=np.repeat(shades, len(edges), axis=0), radii=[WIDTH]
    )
