"""A pad as an elastic foundation pressed on a part: which surface, how deep, how much energy.

The pad is a bed of independent columns along its closing direction a (a Winkler foundation). A
column pressed in by delta pushes back along a with k_w delta per area of the pad, so that the
pressure on a smooth surface with inward normal n is p = k_w delta, and its part along a, per area
of surface, is k_w delta (n . a). Beyond the pad's deformable depth a stiff backing takes over.

The pieces of surface over the pad's outline are found once for a pose; force and energy as
functions of the depth are then sums of closed forms, convex in the depth.
"""

from __future__ import annotations

import numpy as np

from reach.arrays import FloatArray, IntArray
from reach.kernels.compiling import compiled
from reach.kernels.prism import (
    OUTSIDE,
    POLYGON_ROOM,
    clip_to_prism,
    node_in_prism,
    normal_in_pad,
    place_triangle,
    triangle_in_pad,
)
from reach.kernels.tree import STACK, MeshTree

BACKING = 20.0
"""Stiffness of what lies behind the deformable layer, in parts of the layer's own."""
DEEPEST = 1.4
"""The search for the depth ends here, in parts of the deformable depth."""
SIDEWAYS = 0.2
"""Surface that may come to face the jaw within a candidate list's life: least (n . a) is minus this."""
MOST_NEWTON = 40


@compiled
def gather(
    mesh: MeshTree,
    T: FloatArray,
    pad_box: FloatArray,
    low: float,
    high: float,
    slack: float,
) -> IntArray:
    """List the triangles that may be pressed after any motion of at most `slack`.

    Args:
        mesh: the part.
        T: T_object_pad, shape (4, 4).
        pad_box: x_min, x_max, y_min, y_max of the outline, shape (4,).
        low: least depth [m].
        high: greatest depth [m].
        slack: how far any point may move against the pad [m].

    Returns:
        Indices of sorted mesh triangles.
    """
    inward, boxes, starts = mesh.inward, mesh.boxes, mesh.starts
    leaves = len(starts) - 1
    wide = np.empty(4)
    wide[0], wide[1] = pad_box[0] - slack, pad_box[1] + slack
    wide[2], wide[3] = pad_box[2] - slack, pad_box[3] + slack
    stack = np.empty(STACK, np.int64)
    found = np.empty(128, np.int64)
    stack[0] = 0
    size, count = 1, 0
    while size > 0:
        size -= 1
        node = stack[size]
        if node_in_prism(boxes, node, T, wide, low - slack, high + slack) > high + slack:
            continue
        if node < leaves - 1:
            stack[size], stack[size + 1] = 2 * node + 2, 2 * node + 1
            size += 2
            continue
        leaf = node - (leaves - 1)
        for t in range(starts[leaf], starts[leaf + 1]):
            along = inward[t, 0] * T[0, 2] + inward[t, 1] * T[1, 2] + inward[t, 2] * T[2, 2]
            if along > -SIDEWAYS and _may_meet(mesh.corners, t, T, wide, low - slack, high + slack):
                if count == len(found):
                    more = np.empty(2 * len(found), np.int64)
                    for i in range(count):
                        more[i] = found[i]
                    found = more
                found[count] = t
                count += 1
    return found[:count].copy()


@compiled
def _may_meet(
    c: FloatArray, t: int, T: FloatArray, wide: FloatArray, low: float, high: float
) -> bool:
    """Whether a triangle's box in the pad's frame meets the widened prism."""
    for axis in range(3):
        least, most = np.inf, -np.inf
        for i in range(3):
            value = (
                T[0, axis] * (c[t, i, 0] - T[0, 3])
                + T[1, axis] * (c[t, i, 1] - T[1, 3])
                + T[2, axis] * (c[t, i, 2] - T[2, 3])
            )
            least, most = min(least, value), max(most, value)
        if axis == 2:
            if least > high or most < low:
                return False
        elif least > wide[2 * axis + 1] or most < wide[2 * axis]:
            return False
    return True


@compiled
def pieces_over_pad(
    mesh: MeshTree,
    listed: IntArray,
    T: FloatArray,
    edges: FloatArray,
    low: float,
    high: float,
    triangles: FloatArray,
    normals: FloatArray,
) -> int:
    """Cut the listed triangles that face the pad to its outline.

    Args:
        mesh: the part.
        listed: indices of triangles.
        T: T_object_pad, shape (4, 4).
        edges: half-planes of the pad's outline, shape (K, 3).
        low: least depth [m].
        high: greatest depth [m].
        triangles: receives corners, pad frame; room for `most_pieces` a triangle, (room, 3, 3).
        normals: receives inward normals, pad frame, shape (room, 3).

    Returns:
        Number of pieces.
    """
    corners, normal = np.empty((3, 3)), np.empty(3)
    polygon = np.empty((len(edges) + POLYGON_ROOM, 3))
    spare = np.empty((len(edges) + POLYGON_ROOM, 4))
    mesh_corners, inward = mesh.corners, mesh.inward
    found = 0
    for index in range(len(listed)):
        t = listed[index]
        if not normal_in_pad(inward, t, T, normal):
            continue
        triangle_in_pad(mesh_corners, t, T, corners)
        if place_triangle(corners, edges, low, high) == OUTSIDE:
            continue
        count = clip_to_prism(corners, edges, low, high, polygon, spare)
        for i in range(1, count - 1):
            for axis in range(3):
                triangles[found, 0, axis] = polygon[0, axis]
                triangles[found, 1, axis] = polygon[i, axis]
                triangles[found, 2, axis] = polygon[i + 1, axis]
                normals[found, axis] = normal[axis]
            found += 1
    return found


@compiled
def columns_of(count: int, triangles: FloatArray, columns: FloatArray) -> None:
    """Write the area on the pad and the sorted depths of every piece, shape (>= count, 4)."""
    for t in range(count):
        ux, uy = (
            triangles[t, 1, 0] - triangles[t, 0, 0],
            triangles[t, 1, 1] - triangles[t, 0, 1],
        )
        vx, vy = (
            triangles[t, 2, 0] - triangles[t, 0, 0],
            triangles[t, 2, 1] - triangles[t, 0, 1],
        )
        a, b, c = triangles[t, 0, 2], triangles[t, 1, 2], triangles[t, 2, 2]
        low, high = min(a, b, c), max(a, b, c)
        columns[t, 0] = 0.5 * abs(ux * vy - uy * vx)
        columns[t, 1], columns[t, 2], columns[t, 3] = low, a + b + c - low - high, high


@compiled
def pressed(count: int, columns: FloatArray, depth: float) -> tuple[float, float, float]:
    """Sums over all columns at a depth: pressed area, its depth, and half its depth squared.

    Returns:
        integral of [delta > 0], of delta, and of delta^2 / 2 over the pad, delta = depth - z:
        for unit stiffness the force's slope, the force, and the energy.
    """
    slope, force, energy = 0.0, 0.0, 0.0
    for t in range(count):
        a = depth - columns[t, 1]
        if a <= 0.0:
            continue
        area, b, c = columns[t, 0], depth - columns[t, 2], depth - columns[t, 3]
        if b <= 0.0:
            part = area * a * a / ((a - b) * (a - c))
            slope += part
            force += part * a / 3.0
            energy += part * a * a / 12.0
            continue
        slope += area
        force += area * (a + b + c) / 3.0
        energy += area * (a * a + b * b + c * c + a * b + b * c + c * a) / 12.0
        if c < 0.0:
            part = area * c * c / ((a - c) * (b - c))
            slope -= part
            force -= part * c / 3.0
            energy -= part * c * c / 12.0
    return slope, force, energy


@compiled
def press(
    count: int, columns: FloatArray, force: float, stiffness: float, limit: float
) -> tuple[float, float, float]:
    """Press a pad on until its columns push back with a given force.

    Args:
        count: number of columns.
        columns: from [columns_of][reach.kernels.settle_press.columns_of].
        force: closing force f_C [N].
        stiffness: k_w [N/m^3].
        limit: deformable depth of the pad [m].

    Returns:
        Depth of the pad's face [m], energy stored [J], and the factor by which the pressures must
        be multiplied to give the force: 1 unless a tip as sharp as a needle goes in to the end.
    """
    first = np.inf
    for t in range(count):
        first = min(first, columns[t, 1])
    end = first + DEEPEST * limit
    depth = first + limit
    energy, push = 0.0, 0.0
    for _ in range(MOST_NEWTON):
        slope, push, energy = pressed(count, columns, depth)
        if depth > first + limit:
            more_slope, more_push, more_energy = pressed(count, columns, depth - limit)
            slope += BACKING * more_slope
            push += BACKING * more_push
            energy += BACKING * more_energy
        error = stiffness * push - force
        if abs(error) <= 1e-7 * force or (depth >= end and error < 0.0):
            break
        # Newton on a convex increasing function: from the right it never passes the root.
        after = depth - error / max(stiffness * slope, 1e-12)
        depth = min(max(after, 0.5 * (first + depth)), end)
    return depth, stiffness * energy, force / max(stiffness * push, 1e-12)
