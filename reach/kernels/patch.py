"""The contact patch of one pad by clipping ([Danielczuk2019] Sect. 4.1), without booleans.

Two passes over the tree of the mesh: a branch-and-bound search for d_con, the depth at which the
pad first touches inside its prism, then a collection of the surface that faces the jaw within the
slab d_con to d_con + d_def. All results are in the pad's frame (z is the depth).
"""

from __future__ import annotations

import numpy as np

from reach.arrays import FloatArray, IntArray
from reach.kernels.clipping import clip
from reach.kernels.compiling import compiled
from reach.kernels.tree import MeshTree

FACING = 1e-6
"""A surface faces the jaw if its inward normal has more than this along the closing direction."""
NEVER = 1e30
"""Depth of contact of a pad that meets nothing."""
STACK = 64
OUTSIDE, CUT, INSIDE = 0, 1, 2
POLYGON_ROOM = 24
"""Corners of a clipped triangle beyond those of the pad's outline: three, and two planes each way."""


@compiled
def node_in_prism(
    boxes: FloatArray, node: int, T: FloatArray, pad_box: FloatArray, low: float, high: float
) -> float:
    """Least depth of a node's box if it may meet the prism between two depths, else NEVER."""
    dx = boxes[node, 0] - T[0, 3]
    dy = boxes[node, 1] - T[1, 3]
    dz = boxes[node, 2] - T[2, 3]
    hx, hy, hz = boxes[node, 3], boxes[node, 4], boxes[node, 5]
    z = T[0, 2] * dx + T[1, 2] * dy + T[2, 2] * dz
    extent = abs(T[0, 2]) * hx + abs(T[1, 2]) * hy + abs(T[2, 2]) * hz
    if z - extent > high or z + extent < low:
        return NEVER
    least = float(z - extent)
    x = T[0, 0] * dx + T[1, 0] * dy + T[2, 0] * dz
    extent = abs(T[0, 0]) * hx + abs(T[1, 0]) * hy + abs(T[2, 0]) * hz
    if x - extent > pad_box[1] or x + extent < pad_box[0]:
        return NEVER
    y = T[0, 1] * dx + T[1, 1] * dy + T[2, 1] * dz
    extent = abs(T[0, 1]) * hx + abs(T[1, 1]) * hy + abs(T[2, 1]) * hz
    if y - extent > pad_box[3] or y + extent < pad_box[2]:
        return NEVER
    return least


@compiled
def facing_triangle_in_pad(
    c: FloatArray, n: FloatArray, triangle: int, T: FloatArray, out: FloatArray
) -> bool:
    """Write a triangle's corners in the pad's frame; false if it turns away from the jaw."""
    along = n[triangle, 0] * T[0, 2] + n[triangle, 1] * T[1, 2] + n[triangle, 2] * T[2, 2]
    if along <= FACING:
        return False
    for corner in range(3):
        dx = c[triangle, corner, 0] - T[0, 3]
        dy = c[triangle, corner, 1] - T[1, 3]
        dz = c[triangle, corner, 2] - T[2, 3]
        for axis in range(3):
            out[corner, axis] = T[0, axis] * dx + T[1, axis] * dy + T[2, axis] * dz
    return True


@compiled
def inside_outline(points: FloatArray, count: int, edges: FloatArray) -> bool:
    """Whether all points lie over a pad's outline."""
    for edge in range(len(edges)):
        for i in range(count):
            if edges[edge, 0] * points[i, 0] + edges[edge, 1] * points[i, 1] > edges[edge, 2]:
                return False
    return True


@compiled
def place_triangle(
    c: FloatArray,
    n: FloatArray,
    triangle: int,
    T: FloatArray,
    edges: FloatArray,
    low: float,
    high: float,
    corners: FloatArray,
) -> int:
    """Say whether a facing triangle lies inside the prism, outside, or must be clipped.

    Args:
        c: corners of the mesh's sorted triangles, shape (F, 3, 3).
        n: their inward normals, shape (F, 3).
        triangle: index.
        T: T_object_pad, shape (4, 4).
        edges: half-planes of the pad's outline, shape (K, 3).
        low: least depth [m].
        high: greatest depth [m].
        corners: receives the corners, pad frame, unless outside, shape (3, 3).
    """
    rxx, rxy, rxz = T[0, 0], T[0, 1], T[0, 2]
    ryx, ryy, ryz = T[1, 0], T[1, 1], T[1, 2]
    rzx, rzy, rzz = T[2, 0], T[2, 1], T[2, 2]
    if n[triangle, 0] * rxz + n[triangle, 1] * ryz + n[triangle, 2] * rzz <= FACING:
        return OUTSIDE
    px, py, pz = T[0, 3], T[1, 3], T[2, 3]
    ax, ay, az = c[triangle, 0, 0] - px, c[triangle, 0, 1] - py, c[triangle, 0, 2] - pz
    bx, by, bz = c[triangle, 1, 0] - px, c[triangle, 1, 1] - py, c[triangle, 1, 2] - pz
    cx, cy, cz = c[triangle, 2, 0] - px, c[triangle, 2, 1] - py, c[triangle, 2, 2] - pz
    z0 = rxz * ax + ryz * ay + rzz * az
    z1 = rxz * bx + ryz * by + rzz * bz
    z2 = rxz * cx + ryz * cy + rzz * cz
    if min(z0, z1, z2) >= high or max(z0, z1, z2) < low:
        return OUTSIDE
    x0, y0 = rxx * ax + ryx * ay + rzx * az, rxy * ax + ryy * ay + rzy * az
    x1, y1 = rxx * bx + ryx * by + rzx * bz, rxy * bx + ryy * by + rzy * bz
    x2, y2 = rxx * cx + ryx * cy + rzx * cz, rxy * cx + ryy * cy + rzy * cz
    state = INSIDE if min(z0, z1, z2) >= low and max(z0, z1, z2) <= high else CUT
    for edge in range(len(edges)):
        u, v, limit = edges[edge, 0], edges[edge, 1], edges[edge, 2]
        d0, d1, d2 = u * x0 + v * y0, u * x1 + v * y1, u * x2 + v * y2
        if min(d0, d1, d2) > limit:
            return OUTSIDE
        if max(d0, d1, d2) > limit:
            state = CUT
    corners[0, 0], corners[0, 1], corners[0, 2] = x0, y0, z0
    corners[1, 0], corners[1, 1], corners[1, 2] = x1, y1, z1
    corners[2, 0], corners[2, 1], corners[2, 2] = x2, y2, z2
    return state


@compiled
def clip_to_prism(
    points: FloatArray,
    edges: FloatArray,
    low: float,
    high: float,
    first: FloatArray,
    second: FloatArray,
) -> int:
    """Clip a triangle to a pad's outline and to two depths; the polygon ends up in `first`."""
    count = 3
    for i in range(3):
        for axis in range(3):
            first[i, axis] = points[i, axis]
    steps = len(edges) + 2
    for step in range(steps):
        if step < len(edges):
            ax, ay, az, limit = edges[step, 0], edges[step, 1], 0.0, edges[step, 2]
        elif step == len(edges):
            ax, ay, az, limit = 0.0, 0.0, -1.0, -low
        else:
            ax, ay, az, limit = 0.0, 0.0, 1.0, high
        outside = False
        for i in range(count):
            if ax * first[i, 0] + ay * first[i, 1] + az * first[i, 2] > limit:
                outside = True
                break
        if outside:
            count = clip(first, count, ax, ay, az, limit, second)
            if count == 0:
                return 0
            for i in range(count):
                for axis in range(3):
                    first[i, axis] = second[i, axis]
    return count


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
    corners = np.empty((3, 3))
    first = np.empty((len(edges) + POLYGON_ROOM, 3))
    second = np.empty((len(edges) + POLYGON_ROOM, 3))
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
            if not facing_triangle_in_pad(mesh_corners, inward, triangle, T, corners):
                continue
            least = min(corners[0, 2], corners[1, 2], corners[2, 2])
            if least >= min(best, high):
                continue
            if least >= low and inside_outline(corners, 3, edges):
                best = least
                continue
            count = clip_to_prism(corners, edges, low, min(best, high), first, second)
            for i in range(count):
                best = min(best, first[i, 2])
    return best


@compiled
def collect_patch(
    mesh: MeshTree,
    T: FloatArray,
    edges: FloatArray,
    pad_box: FloatArray,
    low: float,
    high: float,
    triangles: FloatArray,
    owners: IntArray,
) -> tuple[int, FloatArray, IntArray]:
    """Collect the surface that faces a pad within its prism between two depths.

    Args:
        mesh: the part.
        T: T_object_pad, shape (4, 4).
        edges: half-planes of the pad's outline, shape (K, 3).
        pad_box: x_min, x_max, y_min, y_max of the outline, shape (4,).
        low: least depth, d_con [m].
        high: greatest depth, d_con + d_def [m].
        triangles: room for the result, shape (capacity, 3, 3); a larger array is made if needed.
        owners: room, shape (capacity,).

    Returns:
        The number of triangles, their corners in the pad's frame, and for each the index of the
        sorted mesh triangle that it is a piece of; both arrays may be longer than the number.
    """
    found = 0
    # Plain arrays: a named tuple in a loop costs a reference count for each of its members.
    mesh_corners, inward, boxes, starts = mesh.corners, mesh.inward, mesh.boxes, mesh.starts
    leaves = len(starts) - 1
    stack = np.empty(STACK, np.int64)
    corners = np.empty((3, 3))
    first = np.empty((len(edges) + POLYGON_ROOM, 3))
    second = np.empty((len(edges) + POLYGON_ROOM, 3))
    stack[0] = 0
    size = 1
    while size > 0:
        size -= 1
        node = stack[size]
        if node_in_prism(boxes, node, T, pad_box, low, high) == NEVER:
            continue
        if node < leaves - 1:
            stack[size], stack[size + 1] = 2 * node + 2, 2 * node + 1
            size += 2
            continue
        leaf = node - (leaves - 1)
        for triangle in range(starts[leaf], starts[leaf + 1]):
            state = place_triangle(mesh_corners, inward, triangle, T, edges, low, high, corners)
            if state == OUTSIDE:
                continue
            if found + POLYGON_ROOM + len(edges) > len(owners):
                triangles, owners = _doubled(triangles, owners, POLYGON_ROOM + len(edges))
            if state == INSIDE:
                for i in range(3):
                    for axis in range(3):
                        triangles[found, i, axis] = corners[i, axis]
                owners[found] = triangle
                found += 1
                continue
            count = clip_to_prism(corners, edges, low, high, first, second)
            for i in range(1, count - 1):
                for axis in range(3):
                    triangles[found, 0, axis] = first[0, axis]
                    triangles[found, 1, axis] = first[i, axis]
                    triangles[found, 2, axis] = first[i + 1, axis]
                owners[found] = triangle
                found += 1
    return found, triangles, owners


@compiled
def _doubled(triangles: FloatArray, owners: IntArray, extra: int) -> tuple[FloatArray, IntArray]:
    capacity = 2 * len(owners) + extra
    more_triangles = np.empty((capacity, 3, 3))
    more_owners = np.empty(capacity, np.int64)
    more_triangles[: len(owners)] = triangles
    more_owners[: len(owners)] = owners
    return more_triangles, more_owners
