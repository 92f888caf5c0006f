"""Convex parts of an object, for physics engines that only collide convex solids.

Collisions of a non-convex mesh would otherwise be those of its hull: a mug without a handle.
CoACD's search takes seconds to a minute, so that its result is cached by the mesh's content.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from reach.arrays import FloatArray, IntArray, frozen
from reach.cache import cache_key, cached_arrays
from reach.objects import GraspObject
from reach.world.coacd_process import run_coacd

VERSION = 2
CONCAVITY = 0.05
"""CoACD's concavity threshold, in parts of the diameter: how much hollow a part may fill."""
MOST_PARTS = 48
NEARLY_CONVEX = 5e-3
"""An object that fills its hull but for this share of the volume is its hull."""

ConvexPart = tuple[FloatArray, IntArray]


def convex_parts(obj: GraspObject) -> tuple[ConvexPart, ...]:
    """Split an object into convex parts, cached on disk by the mesh's content.

    Args:
        obj: the object.

    Returns:
        Vertices (V, 3), object frame [m], and faces (F, 3) of each part.

    Source: [Wei2022] approximate convex decomposition with collision-aware concavity (CoACD).
    """
    key = cache_key("convex-parts", VERSION, obj.content_hash, CONCAVITY, MOST_PARTS, NEARLY_CONVEX)
    entry = cached_arrays("decomposition", key, lambda: _packed(_decompose(obj)))
    vertices = np.split(entry["vertices"], entry["vertex_splits"])
    faces = np.split(entry["faces"], entry["face_splits"])
    return tuple(
        (frozen(v), frozen(f, np.int64)) for v, f in zip(vertices, faces, strict=True) if len(v)
    )


def _decompose(obj: GraspObject) -> list[tuple[NDArray[Any], NDArray[Any]]]:
    hull = obj.mesh.convex_hull
    if obj.volume > (1.0 - NEARLY_CONVEX) * float(hull.volume):
        return [(np.asarray(hull.vertices), np.asarray(hull.faces))]
    scale = obj.diameter  # CoACD's thresholds are for parts of about unit size
    parts = run_coacd(
        obj.vertices / scale,
        obj.faces,
        threshold=CONCAVITY,
        max_convex_hull=MOST_PARTS,
        resolution=500,
        mcts_nodes=10,
        mcts_iterations=30,
        max_ch_vertex=64,
        seed=0,
    )
    return [(vertices * scale, faces) for vertices, faces in parts]


def _packed(parts: list[tuple[NDArray[Any], NDArray[Any]]]) -> dict[str, NDArray[Any]]:
    return {
        "vertices": np.concatenate([np.asarray(v, dtype=float) for v, _ in parts]),
        "faces": np.concatenate([np.asarray(f, dtype=np.int64) for _, f in parts]),
        "vertex_splits": np.cumsum([len(v) for v, _ in parts])[:-1],
        "face_splits": np.cumsum([len(f) for _, f in parts])[:-1],
    }
