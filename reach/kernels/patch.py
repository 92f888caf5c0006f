"""The contact patch of one pad by clipping ([Danielczuk2019] Sect. 4.1), without booleans.

Two passes over the tree of the mesh: a branch-and-bound search for d_con, the depth at which the
pad first touches inside its prism, then a collection of the surface that faces the jaw within the
slab d_con to d_con + d_def. All results are in the pad's frame (z is the depth).
"""

from __future__ import annotations

import numpy as np

from reach.arrays import FloatArray
from reach.kernels.compiling import compiled
from reach.kernels.prism import (
    CUT,
    INSIDE,
    NEVER,
    OUTSIDE,
    POLYGON_ROOM,
    clip_to_prism,
    inside_outline,
    most_pieces,
    node_in_prism,
    normal_in_pad,
    place_node,
    place_triangle,
    triangle_in_pad,
)
from reach.kernels.tree import STACK, MeshTree, leaves_below


@compiled
def contact_depth(
    mesh: MeshTree, T: FloatArray, edges: FloatArray, pad_box: FloatArray, low: float, high: float
) -> float:
    """Depth d_con at which a pad first touches the surface inside its prism ([Danielczuk2019] 4.1).

    Args:
        mesh: the part.
        T: T_object_pad, shape (4, 4).
        edges: half-planes of the pad's outline, shape (K, 3).
        pad_box: x_min, x_max, y_min, y_max of the outline, shape (4,).
        low: depth at which the search begins [m].
        high: depth at which it ends [m].

    Returns:
        d_con [m], or NEVER.
    """
    best = NEVER
    # Plain arrays: a named tuple in a loop costs a reference count for each of its members.
    mesh_corners, inward, boxes, starts = mesh.corners, mesh.inward, mesh.boxes, mesh.starts
    leaves = len(starts) - 1
    stack = np.empty(STACK, np.int64)
    bounds = np.empty(STACK)
    corners, normal = np.empty((3, 3)), np.empty(3)
    polygon = np.empty((len(edges) + POLYGON_ROOM, 3))
    spare = np.empty((len(edges) + POLYGON_ROOM, 4))
    stack[0], bounds[0] = 0, node_in_prism(boxes, 0, T, pad_box, low, high)
    size = 1
    while size > 0:
        size -= 1
        node = stack[size]
        if bounds[size] >= min(best, high):
            continue
        if node < leaves - 1:
            left = node_in_prism(boxes, 2 * node + 1, T, pad_box, low, min(best, high))
            right = node_in_prism(boxes, 2 * node + 2, T, pad_box, low, min(best, high))
            near, far = 2 * node + 1, 2 * node + 2
            if right < left:
                near, far, left, right = far, near, right, left
            if right < NEVER:
                stack[size], bounds[size] = far, right
                size += 1
            if left < NEVER:
                stack[size], bounds[size] = near, left
                size += 1
            continue
        leaf = node - (leaves - 1)
        for triangle in range(starts[leaf], starts[leaf + 1]):
            if not normal_in_pad(inward, triangle, T, normal):
                continue
            triangle_in_pad(mesh_corners, triangle, T, corners)
            least = min(corners[0, 2], corners[1, 2], corners[2, 2])
            if least >= min(best, high):
                continue
            if least >= low and inside_outline(corners, 3, edges):
                best = least
                continue
            count = clip_to_prism(corners, edges, low, min(best, high), polygon, spare)
            for i in range(count):
                best = min(best, polygon[i, 2])
    return best


@compiled
def collect_patch(
    mesh: MeshTree,
    T: FloatArray,
    edges: FloatArray,
    low: float,
    high: float,
    triangles: FloatArray,
    normals: FloatArray,
) -> tuple[int, FloatArray, FloatArray]:
    """Collect the surface that faces a pad within its prism between two depths.

    Args:
        mesh: the part.
        T: T_object_pad, shape (4, 4).
        edges: half-planes of the pad's outline, shape (K, 3).
        low: least depth, d_con [m].
        high: greatest depth, d_con + d_def [m].
        triangles: room for the result, shape (capacity, 3, 3); a larger array is made if needed.
        normals: room, shape (capacity, 3).

    Returns:
        The number of triangles, their corners [m] and their inward unit normals, pad frame; both
        arrays may be longer than the number.
    """
    found = 0
    # Plain arrays: a named tuple in a loop costs a reference count for each of its members.
    mesh_corners, inward, boxes, starts = mesh.corners, mesh.inward, mesh.boxes, mesh.starts
    leaves = len(starts) - 1
    pieces = most_pieces(len(edges))
    stack = np.empty(STACK, np.int64)
    corners, normal = np.empty((3, 3)), np.empty(3)
    polygon = np.empty((len(edges) + POLYGON_ROOM, 3))
    spare = np.empty((len(edges) + POLYGON_ROOM, 4))
    stack[0] = 0
    size = 1
    while size > 0:
        size -= 1
        node = stack[size]
        place = place_node(boxes, node, T, edges, low, high)
        if place == OUTSIDE:
            continue
        if place == CUT and node < leaves - 1:
            stack[size], stack[size + 1] = 2 * node + 2, 2 * node + 1
            size += 2
            continue
        leaf, last = leaves_below(node, leaves)
        start, stop = starts[leaf], starts[last]
        room = found + (stop - start) * pieces
        if room > len(normals):
            triangles, normals = _grown(triangles, normals, found, 2 * room)
        for t in range(start, stop):
            if not normal_in_pad(inward, t, T, normal):
                continue
            triangle_in_pad(mesh_corners, t, T, corners)
            where = place
            if place == CUT:
                where = place_triangle(corners, edges, low, high)
                if where == OUTSIDE:
                    continue
            if where == INSIDE:
                for i in range(3):
                    for axis in range(3):
                        triangles[found, i, axis] = corners[i, axis]
                    normals[found, i] = normal[i]
                found += 1
                continue
            count = clip_to_prism(corners, edges, low, high, polygon, spare)
            for i in range(1, count - 1):
                for axis in range(3):
                    triangles[found, 0, axis] = polygon[0, axis]
                    triangles[found, 1, axis] = polygon[i, axis]
                    triangles[found, 2, axis] = polygon[i + 1, axis]
                    normals[found, axis] = normal[axis]
                found += 1
    return found, triangles, normals


@compiled
def _grown(
    triangles: FloatArray, normals: FloatArray, count: int, capacity: int
) -> tuple[FloatArray, FloatArray]:
    more_triangles, more_normals = np.empty((capacity, 3, 3)), np.empty((capacity, 3))
    for t in range(count):
        for axis in range(3):
            more_normals[t, axis] = normals[t, axis]
            for corner in range(3):
                more_triangles[t, corner, axis] = triangles[t, corner, axis]
    return more_triangles, more_normals
