"""The elliptical area contact, compiled: one ellipse a patch ([Ciocarlie2007])."""

from __future__ import annotations

import numpy as np

from reach.arrays import FloatArray, IntArray
from reach.kernels.compiling import compiled
from reach.kernels.elements import POINT
from reach.kernels.friction_point import place_contact, write_friction_point, write_normal_force
from reach.kernels.pads import Pads
from reach.kernels.tree import MeshTree
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
            place_contact(T_wrench_pad, center_pad, normal_pad, c, normal)
            write_normal_force(c, normal, force[n], length, normals[contacts])
            limit = friction[n] * force[n]
            write_friction_point(
                elements, contacts, c, normal, True, HERTZ_TORSION * radius, limit, length
            )
            contacts += 1
        missing[n] = lost
        margins[n], reasons[n] = hold(
            min(2, jaws), normals[:contacts], elements, starts[: contacts + 1], gravity, cap
        )
