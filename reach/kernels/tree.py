"""Bounding-volume tree over a mesh's triangles, and the named tuple that kernels read.

The tree is a complete binary tree: the children of node i are 2 i + 1 and 2 i + 2, each level
halves every segment of triangles at the median along its longest axis. Nothing needs pointers,
and all levels are built by vectorized sorts.
"""

from __future__ import annotations

from typing import NamedTuple
from weakref import WeakKeyDictionary

import numpy as np

from reach.arrays import FloatArray, IntArray
from reach.kernels.compiling import compiled
from reach.objects import GraspObject

TRIANGLES_PER_LEAF = 16
STACK = 64
"""Room for the nodes that a walk through a tree has yet to visit: one a level, and one more."""


class MeshTree(NamedTuple):
    """A mesh as the kernels see it; triangles are sorted by leaf.

    Attributes:
        corners: shape (F, 3, 3), object frame [m].
        inward: unit normals pointing into the part, shape (F, 3); zero where degenerate.
        boxes: center and half extents of every node's box, shape (nodes, 6), object frame [m].
        starts: first triangle of every leaf, and F at the end, shape (leaves + 1,).
        faces: index of each sorted triangle in the object's own list, shape (F,).
    """

    corners: FloatArray
    inward: FloatArray
    boxes: FloatArray
    starts: IntArray
    faces: IntArray


_TREES: WeakKeyDictionary[GraspObject, MeshTree] = WeakKeyDictionary()


def mesh_tree(obj: GraspObject) -> MeshTree:
    """Return the tree of an object's surface, built once per object."""
    tree = _TREES.get(obj)
    if tree is None:
        tree = _TREES[obj] = build_tree(obj.triangles, -obj.face_normals)
    return tree


def build_tree(corners: FloatArray, inward: FloatArray) -> MeshTree:
    """Sort triangles (F, 3, 3) with inward normals (F, 3) into a complete binary tree."""
    count = len(corners)
    levels = max(0, int(np.ceil(np.log2(count / TRIANGLES_PER_LEAF))))
    centers = corners.mean(axis=1)
    order = np.arange(count)
    for level in range(levels):
        starts = _segments(count, level)
        sorted_centers = centers[order]
        extents = np.maximum.reduceat(sorted_centers, starts[:-1]) - np.minimum.reduceat(
            sorted_centers, starts[:-1]
        )
        segment = np.repeat(np.arange(len(starts) - 1), np.diff(starts))
        axis = np.argmax(extents, axis=1)[segment]
        order = order[np.lexsort((sorted_centers[np.arange(count), axis], segment))]
    starts = _segments(count, levels)
    corners = np.ascontiguousarray(corners[order])
    return MeshTree(
        corners, np.ascontiguousarray(inward[order]), _boxes(corners, starts), starts, order
    )


def _segments(count: int, level: int) -> IntArray:
    starts: IntArray = (np.arange(2**level + 1, dtype=np.int64) * count) // 2**level
    return starts


def _boxes(corners: FloatArray, starts: IntArray) -> FloatArray:
    low = np.minimum.reduceat(corners.min(axis=1), starts[:-1])
    high = np.maximum.reduceat(corners.max(axis=1), starts[:-1])
    levels = [(low, high)]
    while len(low) > 1:
        low, high = np.minimum(low[::2], low[1::2]), np.maximum(high[::2], high[1::2])
        levels.append((low, high))
    lows = np.concatenate([level[0] for level in reversed(levels)])
    highs = np.concatenate([level[1] for level in reversed(levels)])
    return np.ascontiguousarray(np.hstack([(lows + highs) / 2, (highs - lows) / 2]))


@compiled
def leaves_below(node: int, leaves: int) -> tuple[int, int]:
    """First leaf below a node, and the leaf after the last one."""
    first = last = node
    while first < leaves - 1:
        first, last = 2 * first + 1, 2 * last + 2
    return first - (leaves - 1), last - (leaves - 2)
