"""Verdicts of one grasp under many parameter sets, from patches that are found once.

A cross-validation asks for the same grasp, at the same perturbed poses, under a hundred draws of
friction, torsion and compliance. Where a pad touches depends on none of them, and the patch only
on how deep the pad is pressed in. And Lambda grows with friction (every limit surface is scaled by
it), so that a sample that holds at one friction holds at every greater one: of the draws that
share a depth the least friction that holds is found by halving.

Draws are given in groups that share a depth, each sorted by friction. Results are numbers of
samples that hold, one a draw.
"""

from __future__ import annotations

import numpy as np

from reach.arrays import FloatArray, IntArray
from reach.kernels.compiling import compiled
from reach.kernels.elements import POINT, START
from reach.kernels.ellipse_contact import HERTZ_TORSION, fit_ellipse
from reach.kernels.friction_point import place_contact, write_friction_point, write_normal_force
from reach.kernels.min_norm import WRENCHES, exit_of_ray
from reach.kernels.pads import Pads
from reach.kernels.point_contact import contact_point
from reach.kernels.tree import MeshTree
from reach.kernels.verdict import (
    MOST_STEPS,
    TOLERANCE,
    compose,
    contact_elements,
    find_patch,
    make_workspace,
    to_wrench_frame,
)

MAGNITUDE = 12
"""Row of a friction point that holds its magnitude: the only one that friction changes."""


@compiled
def _holds(
    normals: FloatArray, points: FloatArray, starts: IntArray, gravity: FloatArray, cap: float
) -> bool:
    """Whether contacts hold a weight: the verdict of `hold`, without the reason."""
    ray = np.zeros(6)
    for i in range(3):
        ray[i] = -gravity[i]
    margin, _ = exit_of_ray(normals, points, starts, ray, cap, TOLERANCE, MOST_STEPS, WRENCHES)
    return bool(margin >= 1.0)


@compiled
def _count_holding(
    normals: FloatArray,
    points: FloatArray,
    starts: IntArray,
    gravity: FloatArray,
    cap: float,
    friction: FloatArray,
    held: IntArray,
) -> None:
    """Add one to every draw of a group that holds.

    Args:
        normals: wrench of each contact's pressure, shape (J, 6).
        points: friction points of friction 1, shape (POINT, P); restored.
        starts: first point of each contact, and the end.
        gravity: the weight, shape (3,) [N].
        cap: of the margin.
        friction: of the draws, rising, shape (D,).
        held: shape (D,).
    """
    unit = points[MAGNITUDE, : starts[-1]].copy()
    low, high = 0, len(friction)  # what is below `low` slips, what is at `high` or above holds
    while low < high:
        middle = (low + high) // 2
        for column in range(len(unit)):
            points[MAGNITUDE, column] = friction[middle] * unit[column]
        if _holds(normals, points, starts, gravity, cap):
            high = middle
        else:
            low = middle + 1
    points[MAGNITUDE, : starts[-1]] = unit
    for draw in range(high, len(friction)):
        held[draw] += 1


@compiled
def count_area_draws(
    mesh: MeshTree,
    pads: Pads,
    T_object_gripper: FloatArray,
    gravity_object: FloatArray,
    com_object: FloatArray,
    factor: FloatArray,
    force: float,
    depth: FloatArray,
    groups: IntArray,
    friction: FloatArray,
    cap: float,
    length: float,
    held: IntArray,
) -> None:
    """Count the samples that hold by the area contact model.

    Args:
        mesh: the part.
        pads: the gripper.
        T_object_gripper: of the samples, shape (S, 4, 4).
        gravity_object: weight vectors in the object's frame, shape (S, 3) [N].
        com_object: center of mass, shape (3,) [m].
        factor: of friction, shape (S,).
        force: closing force [N].
        depth: d_def of each group and jaw, shape (K, J) [m].
        groups: first draw of each group, and the end, shape (K + 1,).
        friction: of the draws, rising in each group, shape (D,).
        cap: of the margin.
        length: torque scale [m].
        held: receives the counts, shape (D,).
    """
    jaws = len(pads.edges)
    space = make_workspace(jaws)
    normals = np.empty((jaws, 6))
    starts = np.empty(jaws + 1, np.int64)
    starts[0] = 0
    for n in range(len(factor)):
        T = T_object_gripper[n]
        to_com, gravity = to_wrench_frame(T, com_object, gravity_object[n])
        for k in range(len(depth)):
            contacts, column = 0, START
            for jaw in range(jaws):
                T_pad = pads.T_gripper_pad[jaw]
                count, high, space = find_patch(
                    mesh, pads, jaw, compose(T, T_pad), depth[k, jaw], space
                )
                if count == 0:
                    continue
                column, area = contact_elements(
                    count,
                    high,
                    force,
                    factor[n],
                    compose(to_com, T_pad),
                    length,
                    space,
                    column,
                    normals[contacts],
                )
                if area > 0.0:
                    contacts += 1
                    starts[contacts] = column
            if contacts < min(2, jaws):
                continue
            own = slice(groups[k], groups[k + 1])
            _count_holding(
                normals[:contacts],
                space.points,
                starts[: contacts + 1],
                gravity,
                cap,
                friction[own],
                held[own],
            )


@compiled
def count_ellipse_draws(
    mesh: MeshTree,
    pads: Pads,
    T_object_gripper: FloatArray,
    gravity_object: FloatArray,
    com_object: FloatArray,
    factor: FloatArray,
    force: float,
    depth: FloatArray,
    groups: IntArray,
    friction: FloatArray,
    cap: float,
    length: float,
    held: IntArray,
) -> None:
    """Count the samples that hold by elliptical contacts; arguments as of `count_area_draws`."""
    jaws = len(pads.edges)
    space = make_workspace(jaws)
    elements = np.empty((POINT, jaws))
    normals = np.empty((jaws, 6))
    starts = np.arange(jaws + 1)
    center_pad, normal_pad = np.empty(3), np.empty(3)
    c, normal = np.empty(3), np.empty(3)
    for n in range(len(factor)):
        T = T_object_gripper[n]
        to_com, gravity = to_wrench_frame(T, com_object, gravity_object[n])
        for k in range(len(depth)):
            contacts = 0
            for jaw in range(jaws):
                T_pad = pads.T_gripper_pad[jaw]
                count, _, space = find_patch(
                    mesh, pads, jaw, compose(T, T_pad), depth[k, jaw], space
                )
                area, radius = fit_ellipse(count, space, center_pad, normal_pad)
                if not area > 0.0:
                    continue
                place_contact(compose(to_com, T_pad), center_pad, normal_pad, c, normal)
                write_normal_force(c, normal, force, length, normals[contacts])
                turn, limit = HERTZ_TORSION * radius, factor[n] * force
                write_friction_point(elements, contacts, c, normal, True, turn, limit, length)
                contacts += 1
            if contacts < min(2, jaws):
                continue
            own = slice(groups[k], groups[k + 1])
            _count_holding(
                normals[:contacts],
                elements,
                starts[: contacts + 1],
                gravity,
                cap,
                friction[own],
                held[own],
            )


@compiled
def count_point_draws(
    mesh: MeshTree,
    pads: Pads,
    T_object_gripper: FloatArray,
    gravity_object: FloatArray,
    com_object: FloatArray,
    factor: FloatArray,
    force: float,
    torsion: FloatArray,
    friction: FloatArray,
    cap: float,
    length: float,
    held: IntArray,
) -> None:
    """Count the samples that hold by soft point contacts.

    The arguments are those of `count_area_draws`, with the draws' `torsion`, shape (D,) [m], in
    place of groups that share a depth.
    """
    jaws = len(pads.edges)
    space = make_workspace(jaws)
    elements = np.empty((POINT, 2 * jaws))
    normals = np.empty((jaws, 6))
    starts = np.arange(jaws + 1) * 2
    center_pad, normal_pad = np.empty(3), np.empty(3)
    points, inward = np.empty((jaws, 3)), np.empty((jaws, 3))
    for n in range(len(factor)):
        T = T_object_gripper[n]
        to_com, gravity = to_wrench_frame(T, com_object, gravity_object[n])
        contacts = 0
        for jaw in range(jaws):
            T_pad = pads.T_gripper_pad[jaw]
            touches, space = contact_point(
                mesh, pads, jaw, compose(T, T_pad), space, center_pad, normal_pad
            )
            if not touches:
                continue
            c, normal = points[contacts], inward[contacts]
            place_contact(compose(to_com, T_pad), center_pad, normal_pad, c, normal)
            write_normal_force(c, normal, force, length, normals[contacts])
            contacts += 1
        if contacts < min(2, jaws):
            continue
        for draw in range(len(friction)):
            limit = factor[n] * friction[draw] * force
            for i in range(contacts):
                c, normal = points[i], inward[i]
                write_friction_point(elements, 2 * i, c, normal, True, 0.0, limit, length)
                write_friction_point(
                    elements, 2 * i + 1, c, normal, False, torsion[draw], force, length
                )
            if _holds(normals[:contacts], elements, starts[: contacts + 1], gravity, cap):
                held[draw] += 1
