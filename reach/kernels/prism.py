"""Where boxes and triangles lie against a pad's prism, and clipping to it.

The prism is the pad's outline swept along its closing direction, between two depths. Everything is
expressed in the frame of the opened pad: z is the depth.
"""

from __future__ import annotations

from reach.arrays import FloatArray
from reach.kernels.clipping import CORNERS, cut
from reach.kernels.compiling import compiled

FACING = 1e-6
"""A surface faces the jaw if its inward normal has more than this along the closing direction."""
NEVER = 1e30
"""Depth of contact of a pad that meets nothing."""
OUTSIDE, CUT, INSIDE = 0, 1, 2
POLYGON_ROOM = 24
"""Rows to allot for a clipped triangle beyond the outline's edges: its own three corners, one more
for each of the two depths, and some to spare for planes that graze a side."""


@compiled
def place_node(
    boxes: FloatArray,
    node: int,
    T: FloatArray,
    edges: FloatArray,
    low: float,
    high: float,
) -> int:
    """Say whether all that a node's box holds lies inside the prism, outside, or neither is sure.

    Args:
        boxes: center and half extents, object frame, shape (nodes, 6) [m].
        node: index.
        T: T_object_pad, shape (4, 4).
        edges: half-planes of the pad's outline, shape (K, 3).
        low: least depth [m].
        high: greatest depth [m].
    """
    dx = boxes[node, 0] - T[0, 3]
    dy = boxes[node, 1] - T[1, 3]
    dz = boxes[node, 2] - T[2, 3]
    hx, hy, hz = boxes[node, 3], boxes[node, 4], boxes[node, 5]
    z = T[0, 2] * dx + T[1, 2] * dy + T[2, 2] * dz
    depth = abs(T[0, 2]) * hx + abs(T[1, 2]) * hy + abs(T[2, 2]) * hz
    if z - depth > high or z + depth < low:
        return OUTSIDE
    x = T[0, 0] * dx + T[1, 0] * dy + T[2, 0] * dz
    y = T[0, 1] * dx + T[1, 1] * dy + T[2, 1] * dz
    width = abs(T[0, 0]) * hx + abs(T[1, 0]) * hy + abs(T[2, 0]) * hz
    breadth = abs(T[0, 1]) * hx + abs(T[1, 1]) * hy + abs(T[2, 1]) * hz
    state = INSIDE if z - depth >= low and z + depth <= high else CUT
    for edge in range(len(edges)):
        u, v = edges[edge, 0], edges[edge, 1]
        beyond = u * x + v * y - edges[edge, 2]
        extent = abs(u) * width + abs(v) * breadth
        if beyond > extent:
            return OUTSIDE
        if beyond > -extent:
            state = CUT
    return state


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
def triangle_in_pad(c: FloatArray, triangle: int, T: FloatArray, corners: FloatArray) -> None:
    """Write a triangle's corners in the pad's frame.

    Args:
        c: corners of the mesh's sorted triangles, object frame, shape (F, 3, 3) [m].
        triangle: index.
        T: T_object_pad, shape (4, 4).
        corners: receives the corners, shape (3, 3) [m].
    """
    for i in range(3):
        dx = c[triangle, i, 0] - T[0, 3]
        dy = c[triangle, i, 1] - T[1, 3]
        dz = c[triangle, i, 2] - T[2, 3]
        for axis in range(3):
            corners[i, axis] = T[0, axis] * dx + T[1, axis] * dy + T[2, axis] * dz


@compiled
def normal_in_pad(n: FloatArray, triangle: int, T: FloatArray, normal: FloatArray) -> bool:
    """Write a triangle's inward normal in the pad's frame, and say whether it faces the jaw."""
    for axis in range(3):
        normal[axis] = (
            T[0, axis] * n[triangle, 0] + T[1, axis] * n[triangle, 1] + T[2, axis] * n[triangle, 2]
        )
    return bool(normal[2] > FACING)


@compiled
def place_triangle(corners: FloatArray, edges: FloatArray, low: float, high: float) -> int:
    """Say whether a triangle lies inside the prism, outside, or must be clipped.

    Args:
        corners: pad frame, shape (3, 3) [m].
        edges: half-planes of the pad's outline, shape (K, 3).
        low: least depth [m].
        high: greatest depth [m].
    """
    x0, y0, z0 = corners[0, 0], corners[0, 1], corners[0, 2]
    x1, y1, z1 = corners[1, 0], corners[1, 1], corners[1, 2]
    x2, y2, z2 = corners[2, 0], corners[2, 1], corners[2, 2]
    least, most = min(z0, z1, z2), max(z0, z1, z2)
    if least >= high or most < low:
        return OUTSIDE
    state = INSIDE if least >= low and most <= high else CUT
    for edge in range(len(edges)):
        u, v, limit = edges[edge, 0], edges[edge, 1], edges[edge, 2]
        d0, d1, d2 = u * x0 + v * y0, u * x1 + v * y1, u * x2 + v * y2
        if min(d0, d1, d2) > limit:
            return OUTSIDE
        if max(d0, d1, d2) > limit:
            state = CUT
    return state


@compiled
def inside_outline(points: FloatArray, count: int, edges: FloatArray) -> bool:
    """Whether all points lie over a pad's outline."""
    for edge in range(len(edges)):
        for i in range(count):
            if edges[edge, 0] * points[i, 0] + edges[edge, 1] * points[i, 1] > edges[edge, 2]:
                return False
    return True


@compiled
def clip_to_prism(
    corners: FloatArray,
    edges: FloatArray,
    low: float,
    high: float,
    polygon: FloatArray,
    spare: FloatArray,
) -> int:
    """Clip a triangle to a pad's outline and to two depths.

    Args:
        corners: pad frame, shape (3, 3) [m].
        edges: half-planes of the pad's outline, shape (K, 3).
        low: least depth [m].
        high: greatest depth [m].
        polygon: receives the corners, shape (K + POLYGON_ROOM, 3).
        spare: scratch, shape (K + POLYGON_ROOM, 4).

    Returns:
        Number of corners, 0 if nothing is left.
    """
    count = CORNERS
    for i in range(3):
        for axis in range(3):
            polygon[i, axis] = corners[i, axis]
    for edge in range(len(edges)):
        u, v, limit = edges[edge, 0], edges[edge, 1], edges[edge, 2]
        count = cut(polygon, count, u, v, 0.0, limit, spare)
    count = cut(polygon, count, 0.0, 0.0, -1.0, -low, spare)
    return cut(polygon, count, 0.0, 0.0, 1.0, high, spare)


@compiled
def most_pieces(edges: int) -> int:
    """Most triangles that one triangle is cut into by an outline's edges and two depths."""
    return edges + 3
