"""The soft point contact, compiled: the rival that knows no area."""

from __future__ import annotations

import numpy as np

from reach.arrays import FloatArray, IntArray
from reach.kernels.compiling import compiled
from reach.kernels.elements import POINT
from reach.kernels.friction_point import place_contact, write_friction_point, write_normal_force
from reach.kernels.pads import Pads
from reach.kernels.prism import NEVER, node_in_prism, normal_in_pad, triangle_in_pad
from reach.kernels.tree import STACK, MeshTree
from reach.kernels.verdict import (
    Workspace,
    compose,
    find_patch,
    hold,
    make_workspace,
    to_wrench_frame,
)

SAME = 1e-12
"""Squared distances from the pad's axis that differ by less are the same [m^2]."""
STEEP = 0.5
"""Normals with less than this along the closing direction (60 degrees off) are outside the friction
cone of any coefficient in use ([Danielczuk2019] Sect. 5.4: up to 1.5)."""


@compiled
def first_hit(mesh: MeshTree, T: FloatArray, low: float, high: float) -> tuple[float, int]:
    """Where the ray from a pad's origin along its closing direction first meets facing surface.

    Returns:
        Depth [m] and index of the sorted triangle, or (NEVER, -1).
    """
    best, owner = NEVER, -1
    here = np.zeros(4)
    leaves = len(mesh.starts) - 1
    stack = np.empty(STACK, np.int64)
    c, normal = np.empty((3, 3)), np.empty(3)
    stack[0] = 0
    size = 1
    while size > 0:
        size -= 1
        node = stack[size]
        if node_in_prism(mesh.boxes, node, T, here, low, min(best, high)) == NEVER:
            continue
        if node < leaves - 1:
            stack[size], stack[size + 1] = 2 * node + 2, 2 * node + 1
            size += 2
            continue
        for triangle in range(mesh.starts[node - leaves + 1], mesh.starts[node - leaves + 2]):
            if not normal_in_pad(mesh.inward, triangle, T, normal):
                continue
            triangle_in_pad(mesh.corners, triangle, T, c)
            w0 = c[1, 0] * c[2, 1] - c[1, 1] * c[2, 0]
            w1 = c[2, 0] * c[0, 1] - c[2, 1] * c[0, 0]
            w2 = c[0, 0] * c[1, 1] - c[0, 1] * c[1, 0]
            inside = (w0 >= 0 and w1 >= 0 and w2 >= 0) or (w0 <= 0 and w1 <= 0 and w2 <= 0)
            total = w0 + w1 + w2
            if not inside or total == 0.0:
                continue
            z = (w0 * c[0, 2] + w1 * c[1, 2] + w2 * c[2, 2]) / total
            if low <= z <= high and z < best:
                best, owner = z, triangle
    return best, owner


@compiled
def nearest_to_axis(
    count: int, triangles: FloatArray, normals: FloatArray, least: float, point: FloatArray
) -> int:
    """Find the point of a patch that lies nearest to the axis x = y = 0 of its pad.

    The axis passes beside the patch, so the point is on an edge of a triangle. Of points equally
    near, the one that the pad meets first is taken, so that it depends on no order.

    Args:
        count: number of triangles.
        triangles: the patch, pad frame, shape (>= count, 3, 3) [m].
        normals: inward unit normals, shape (>= count, 3).
        least: only surface whose normal has at least this along the closing direction counts.
        point: receives the point, pad frame (3,) [m].

    Returns:
        Index of its triangle, -1 if there is none.
    """
    best, owner = NEVER, -1
    for k in range(count):
        if normals[k, 2] < least:
            continue
        for i in range(3):
            a, b = triangles[k, i], triangles[k, (i + 1) % 3]
            dx, dy = b[0] - a[0], b[1] - a[1]
            length = dx * dx + dy * dy
            share = min(max(-(a[0] * dx + a[1] * dy) / length, 0.0), 1.0) if length > 0 else 0.0
            x, y = a[0] + share * dx, a[1] + share * dy
            z = a[2] + share * (b[2] - a[2])
            beyond = x * x + y * y - best
            if beyond < -SAME or (beyond < SAME and z < point[2]):
                best, owner = x * x + y * y, k
                point[0], point[1], point[2] = x, y, z
    return owner


@compiled
def contact_point(
    mesh: MeshTree,
    pads: Pads,
    jaw: int,
    T: FloatArray,
    space: Workspace,
    point: FloatArray,
    normal: FloatArray,
) -> tuple[bool, Workspace]:
    """Find where a jaw's soft point contact is, and the inward normal there, pad frame.

    It is where the jaw's center ray, from the pad's origin along the closing direction, meets the
    part. Where the ray passes the part by although the pad touches it, it is the point nearest to
    the ray of all that the pad can be pressed on: within its outline, and no deeper than its
    `max_deformation` below first contact. A wall that no friction coefficient in use could hold
    counts only if there is nothing else: it carries next to no pressure.

    Args:
        mesh: the part.
        pads: the gripper.
        jaw: which jaw.
        T: T_object_pad of the opened pad, shape (4, 4).
        space: scratch.
        point: receives the point (3,) [m].
        normal: receives the unit normal (3,).

    Returns:
        Whether the jaw touches, and the workspace (see `find_patch`).
    """
    depth, owner = first_hit(mesh, T, pads.ends[jaw, 0], pads.ends[jaw, 1])
    if owner >= 0:
        point[0], point[1], point[2] = 0.0, 0.0, depth
        normal_in_pad(mesh.inward, owner, T, normal)
        return True, space
    count, _, space = find_patch(mesh, pads, jaw, T, pads.max_deformation[jaw], space)
    owner = nearest_to_axis(count, space.triangles, space.normals, STEEP, point)
    if owner < 0:
        owner = nearest_to_axis(count, space.triangles, space.normals, 0.0, point)
    if owner >= 0:
        for i in range(3):
            normal[i] = space.normals[owner, i]
    return owner >= 0, space


@compiled
def judge_point_contacts(
    mesh: MeshTree,
    pads: Pads,
    T_object_gripper: FloatArray,
    gravity_object: FloatArray,
    com_object: FloatArray,
    torsion: float,
    force: FloatArray,
    friction: FloatArray,
    cap: float,
    length: float,
    margins: FloatArray,
    reasons: IntArray,
    missing: IntArray,
    areas: FloatArray,
) -> None:
    """Judge many grasps by soft point contacts: |f_t| <= mu f, |tau| <= torsion f.

    The arguments are those of [judge_area_contacts][reach.kernels.verdict.judge_area_contacts],
    with `torsion` [m] in place of the depth; areas are set to zero.
    """
    jaws = len(pads.edges)
    elements = np.empty((POINT, 2 * jaws))
    normals = np.empty((jaws, 6))
    starts = np.arange(jaws + 1) * 2
    space = make_workspace(jaws)
    center_pad, normal_pad = np.empty(3), np.empty(3)
    c, normal = np.empty(3), np.empty(3)
    areas[:] = 0.0
    for n in range(len(margins)):
        to_com, gravity = to_wrench_frame(T_object_gripper[n], com_object[n], gravity_object[n])
        contacts, lost = 0, 0
        for jaw in range(jaws):
            T = compose(T_object_gripper[n], pads.T_gripper_pad[jaw])
            touches, space = contact_point(mesh, pads, jaw, T, space, center_pad, normal_pad)
            if not touches:
                lost |= 1 << jaw
                continue
            T_wrench_pad = compose(to_com, pads.T_gripper_pad[jaw])
            place_contact(T_wrench_pad, center_pad, normal_pad, c, normal)
            write_normal_force(c, normal, force[n], length, normals[contacts])
            write_friction_point(
                elements, 2 * contacts, c, normal, True, 0.0, friction[n] * force[n], length
            )
            write_friction_point(
                elements, 2 * contacts + 1, c, normal, False, torsion, force[n], length
            )
            contacts += 1
        missing[n] = lost
        margins[n], reasons[n] = hold(
            min(2, jaws), normals[:contacts], elements, starts[: contacts + 1], gravity, cap
        )
