"""The rival contact models, compiled: soft point contact, and one ellipse a patch."""

from __future__ import annotations

import numpy as np

from reach.arrays import FloatArray, IntArray
from reach.kernels.compiling import compiled
from reach.kernels.elements import POINT, wrench_in_frame
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

HERTZ_TORSION = 3.0 * np.pi / 16.0
"""Torsional limit of a Hertzian contact over mu f sqrt(a b) ([Ciocarlie2007])."""


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
def _write_point(
    elements: FloatArray,
    column: int,
    c: FloatArray,
    normal: FloatArray,
    slide: bool,
    turn: float,
    force: float,
    length: float,
) -> None:
    """Write a friction point: sliding perpendicular to a normal (or not), torsion about it."""
    for i in range(3):
        elements[i, column] = c[i] / length
        elements[3 + i, column] = 1.0 - normal[i] * normal[i] if slide else 0.0
        elements[9 + i, column] = normal[i] * turn / length
    elements[6, column] = -normal[0] * normal[1] if slide else 0.0
    elements[7, column] = -normal[0] * normal[2] if slide else 0.0
    elements[8, column] = -normal[1] * normal[2] if slide else 0.0
    elements[12, column] = force


@compiled
def _force_at(
    c: FloatArray, normal: FloatArray, force: float, length: float, wrench: FloatArray
) -> None:
    wrench_in_frame(
        force * normal[0],
        force * normal[1],
        force * normal[2],
        force * (c[1] * normal[2] - c[2] * normal[1]),
        force * (c[2] * normal[0] - c[0] * normal[2]),
        force * (c[0] * normal[1] - c[1] * normal[0]),
        np.eye(4),
        length,
        wrench,
    )


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
    c, normal = np.empty(3), np.empty(3)
    areas[:] = 0.0
    for n in range(len(margins)):
        to_com, gravity = to_wrench_frame(T_object_gripper[n], com_object[n], gravity_object[n])
        contacts, lost = 0, 0
        for jaw in range(jaws):
            T = compose(T_object_gripper[n], pads.T_gripper_pad[jaw])
            depth, owner = first_hit(mesh, T, pads.ends[jaw, 0], pads.ends[jaw, 1])
            if owner < 0:
                lost |= 1 << jaw
                continue
            T_wrench_pad = compose(to_com, pads.T_gripper_pad[jaw])
            for i in range(3):
                c[i] = T_wrench_pad[i, 3] + T_wrench_pad[i, 2] * depth
                normal[i] = 0.0
                for j in range(3):
                    normal[i] += T_object_gripper[n, j, i] * mesh.inward[owner, j]
            _force_at(c, normal, force[n], length, normals[contacts])
            _write_point(
                elements, 2 * contacts, c, normal, True, 0.0, friction[n] * force[n], length
            )
            _write_point(elements, 2 * contacts + 1, c, normal, False, torsion, force[n], length)
            contacts += 1
        missing[n] = lost
        margins[n], reasons[n] = hold(
            min(2, jaws), normals[:contacts], elements, starts[: contacts + 1], gravity, cap
        )


@compiled
def fit_ellipse(
    count: int, space: Workspace, center: FloatArray, normal: FloatArray
) -> tuple[float, float]:
    """Area and geometric-mean semi-axis of the ellipse with a patch's second moments.

    Surface counts by its footprint on the pad, so that a wall almost parallel to the closing
    direction, which carries no pressure, does not tip the mean normal.

    Args:
        count: number of triangles.
        space: holds the patch, pad frame.
        center: receives the centroid, pad frame (3,).
        normal: receives the mean inward normal, pad frame (3,).

    Returns:
        Area [m^2] and sqrt(a b) [m]; a and b are twice the standard deviations in the plane
        perpendicular to the mean normal.
    """
    t = space.triangles
    area, footprint = 0.0, 0.0
    second = np.zeros((3, 3))
    center[:] = 0.0
    normal[:] = 0.0
    for k in range(count):
        ux, uy, uz = t[k, 1, 0] - t[k, 0, 0], t[k, 1, 1] - t[k, 0, 1], t[k, 1, 2] - t[k, 0, 2]
        vx, vy, vz = t[k, 2, 0] - t[k, 0, 0], t[k, 2, 1] - t[k, 0, 1], t[k, 2, 2] - t[k, 0, 2]
        ex, ey, ez = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
        share = 0.5 * np.sqrt(ex * ex + ey * ey + ez * ez)
        area += share
        share *= space.normals[k, 2]
        footprint += share
        for i in range(3):
            si = t[k, 0, i] + t[k, 1, i] + t[k, 2, i]
            center[i] += share * si / 3.0
            normal[i] += share * space.normals[k, i]
            for j in range(3):
                sj = t[k, 0, j] + t[k, 1, j] + t[k, 2, j]
                squares = t[k, 0, i] * t[k, 0, j] + t[k, 1, i] * t[k, 1, j]
                squares += t[k, 2, i] * t[k, 2, j]
                second[i, j] += share / 12.0 * (si * sj + squares)
    if not area > 0.0:
        return 0.0, 0.0
    size = np.sqrt(normal[0] ** 2 + normal[1] ** 2 + normal[2] ** 2)
    for i in range(3):
        center[i] /= footprint
        normal[i] /= size
    for i in range(3):
        for j in range(3):
            second[i, j] = second[i, j] / footprint - center[i] * center[j]
    # The product of the two variances in the plane is n' adj(C) n for the covariance C.
    product = 0.0
    for i in range(3):
        for j in range(3):
            i1, i2, j1, j2 = (i + 1) % 3, (i + 2) % 3, (j + 1) % 3, (j + 2) % 3
            cofactor = second[i1, j1] * second[i2, j2] - second[i1, j2] * second[i2, j1]
            product += normal[i] * cofactor * normal[j]
    return area, 2.0 * max(product, 0.0) ** 0.25


@compiled
def judge_ellipse_contacts(
    mesh: MeshTree,
    pads: Pads,
    T_object_gripper: FloatArray,
    gravity_object: FloatArray,
    com_object: FloatArray,
    depth: FloatArray,
    force: FloatArray,
    friction: FloatArray,
    cap: float,
    length: float,
    margins: FloatArray,
    reasons: IntArray,
    missing: IntArray,
    areas: FloatArray,
) -> None:
    """Judge many grasps by one elliptical limit surface a patch.

    The arguments are those of [judge_area_contacts][reach.kernels.verdict.judge_area_contacts].
    """
    jaws = len(pads.edges)
    space = make_workspace(jaws)
    elements = np.empty((POINT, jaws))
    normals = np.empty((jaws, 6))
    starts = np.arange(jaws + 1)
    center_pad, normal_pad = np.empty(3), np.empty(3)
    c, normal = np.empty(3), np.empty(3)
    for n in range(len(margins)):
        to_com, gravity = to_wrench_frame(T_object_gripper[n], com_object[n], gravity_object[n])
        contacts, lost = 0, 0
        for jaw in range(jaws):
            T = compose(T_object_gripper[n], pads.T_gripper_pad[jaw])
            count, _, space = find_patch(mesh, pads, jaw, T, depth[n, jaw], space)
            areas[n, jaw], radius = fit_ellipse(count, space, center_pad, normal_pad)
            if not areas[n, jaw] > 0.0:
                lost |= 1 << jaw
                continue
            T_wrench_pad = compose(to_com, pads.T_gripper_pad[jaw])
            for i in range(3):
                c[i], normal[i] = T_wrench_pad[i, 3], 0.0
                for j in range(3):
                    c[i] += T_wrench_pad[i, j] * center_pad[j]
                    normal[i] += T_wrench_pad[i, j] * normal_pad[j]
            _force_at(c, normal, force[n], length, normals[contacts])
            limit = friction[n] * force[n]
            _write_point(elements, contacts, c, normal, True, HERTZ_TORSION * radius, limit, length)
            contacts += 1
        missing[n] = lost
        margins[n], reasons[n] = hold(
            min(2, jaws), normals[:contacts], elements, starts[: contacts + 1], gravity, cap
        )
