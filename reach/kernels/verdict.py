"""Patch, pressure, wrench set and verdict of many grasps on one part, compiled."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from reach.arrays import FloatArray, IntArray
from reach.kernels.compiling import compiled
from reach.kernels.elements import POINT, START, friction_points, wrench_in_frame
from reach.kernels.min_norm import FORCES, WRENCHES, exit_of_ray
from reach.kernels.moments import GROUPS, MOMENTS, cell_moments
from reach.kernels.pads import Pads
from reach.kernels.patch import collect_patch, contact_depth
from reach.kernels.prism import NEVER
from reach.kernels.tree import MeshTree

HOLDS, NO_CONTACT, SLIPS, TURNS = 0, 1, 2, 3
"""Codes of a verdict's reason."""
TORQUE_LENGTH = 0.03
"""Torques are divided by this length [m] to be comparable with forces."""
TOLERANCE = 1e-3
MOST_STEPS = 400
FIRST_ROOM = 512
"""Triangles that a patch has room for before its arrays grow."""


class Workspace(NamedTuple):
    """Arrays that one thread reuses from grasp to grasp."""

    triangles: FloatArray
    normals: FloatArray
    sums: FloatArray
    used: IntArray
    points: FloatArray


@compiled
def make_workspace(jaws: int) -> Workspace:
    """Allocate the arrays that one thread reuses from grasp to grasp."""
    return Workspace(
        np.empty((FIRST_ROOM, 3, 3)),
        np.empty((FIRST_ROOM, 3)),
        np.zeros((GROUPS, MOMENTS)),
        np.empty(GROUPS, np.int64),
        np.empty((POINT, jaws * GROUPS * 4)),
    )


@compiled
def compose(A: FloatArray, B: FloatArray) -> FloatArray:
    """Product of two rigid transforms (4, 4)."""
    result = np.zeros((4, 4))
    result[3, 3] = 1.0
    for i in range(3):
        for j in range(3):
            result[i, j] = A[i, 0] * B[0, j] + A[i, 1] * B[1, j] + A[i, 2] * B[2, j]
        result[i, 3] = A[i, 3] + A[i, 0] * B[0, 3] + A[i, 1] * B[1, 3] + A[i, 2] * B[2, 3]
    return result


@compiled
def to_wrench_frame(
    T_object_gripper: FloatArray, com_object: FloatArray, gravity_object: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Frame of the wrenches: the gripper's axes, origin at the center of mass.

    Returns:
        Pose of the gripper in that frame, shape (4, 4), and the weight in it, shape (3,) [N].
    """
    T = T_object_gripper
    to_com = np.eye(4)
    gravity = np.zeros(3)
    for i in range(3):
        for j in range(3):
            to_com[i, 3] -= T[j, i] * (com_object[j] - T[j, 3])
            gravity[i] += T[j, i] * gravity_object[j]
    return to_com, gravity


@compiled
def find_patch(
    mesh: MeshTree, pads: Pads, jaw: int, T_object_pad: FloatArray, depth: float, space: Workspace
) -> tuple[int, float, Workspace]:
    """Find a jaw's patch and its normals, pad frame.

    Args:
        mesh: the part.
        pads: the gripper.
        jaw: which jaw.
        T_object_pad: pose of the opened pad, shape (4, 4).
        depth: how deep the pad is pressed in, d_def [m].
        space: receives `triangles` and `normals`.

    Returns:
        Number of triangles (0 without contact), depth d_con + d_def [m], and the workspace, which
        is another one if the arrays had to grow.
    """
    edges, box = pads.edges[jaw], pads.boxes[jaw]
    first = contact_depth(mesh, T_object_pad, edges, box, pads.ends[jaw, 0], pads.ends[jaw, 1])
    if first == NEVER:
        return 0, NEVER, space
    high = first + depth
    count, triangles, normals = collect_patch(
        mesh, T_object_pad, edges, first, high, space.triangles, space.normals
    )
    return count, high, Workspace(triangles, normals, space.sums, space.used, space.points)


@compiled
def contact_elements(
    count: int,
    high: float,
    force: float,
    friction: float,
    T_wrench_pad: FloatArray,
    length: float,
    space: Workspace,
    first: int,
    wrench: FloatArray,
) -> tuple[int, float]:
    """Normal wrench and friction points of the patch in the workspace.

    Args:
        count: triangles of the patch.
        high: depth where the pressure vanishes [m].
        force: closing force f_C: sum of the normal forces' magnitudes [N].
        friction: coefficient mu.
        T_wrench_pad: pose of the pad in the frame in which wrenches are expressed, shape (4, 4).
        length: torque scale [m].
        space: holds the patch; columns of `space.points` are written from `first` on.
        first: where to write.
        wrench: receives the normal wrench at full force, shape (6,), torques scaled.

    Returns:
        Column after the last one written, and the patch's area [m^2] (0 without pressure).
    """
    m = space.sums
    used = cell_moments(count, space.triangles, space.normals, high, m, space.used)
    total, area = 0.0, 0.0
    fx, fy, fz, tx, ty, tz = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    for i in range(used):
        group = space.used[i]
        total += m[group, 0]
        area += m[group, 22]
        fx, fy, fz = fx + m[group, 10], fy + m[group, 11], fz + m[group, 12]
        tx, ty, tz = tx + m[group, 19], ty + m[group, 20], tz + m[group, 21]
    if not total > 0.0:
        return first, 0.0
    stiffness = force / total  # k of p = k q, from f_C = sum of f_z,max
    wrench_in_frame(fx, fy, fz, tx, ty, tz, T_wrench_pad, length, wrench)
    for i in range(6):
        wrench[i] *= stiffness
    for i in range(used):
        group = space.used[i]
        scale = friction * stiffness
        first = friction_points(m, group, scale, T_wrench_pad, length, space.points, first)
        for column in range(MOMENTS):
            m[group, column] = 0.0
    return first, area


@compiled
def hold(
    needed: int,
    normals: FloatArray,
    points: FloatArray,
    starts: IntArray,
    gravity: FloatArray,
    cap: float,
) -> tuple[float, int]:
    """Whether a set of contacts holds a gravity force at the frame's origin.

    Args:
        needed: how many contacts it takes.
        normals: wrench of each contact's pressure, shape (J, 6), torques scaled.
        points: friction points of all contacts, shape (POINT, P).
        starts: first point of each contact, and the end, shape (J + 1,).
        gravity: the weight, shape (3,) [N].
        cap: of the margin.

    Returns:
        The margin, and the reason's code.
    """
    if len(normals) < needed:
        return 0.0, NO_CONTACT
    ray = np.zeros(6)
    for i in range(3):
        ray[i] = -gravity[i]
    margin, _ = exit_of_ray(normals, points, starts, ray, cap, TOLERANCE, MOST_STEPS, WRENCHES)
    if margin >= 1.0:
        return margin, HOLDS
    force_margin, _ = exit_of_ray(normals, points, starts, ray, 1.0, TOLERANCE, MOST_STEPS, FORCES)
    return margin, SLIPS if force_margin < 1.0 else TURNS


@compiled
def judge_area_contacts(
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
    """Judge many grasps by the area contact model; results are written to the last four arrays.

    Args:
        mesh: the part.
        pads: the gripper.
        T_object_gripper: shape (N, 4, 4).
        gravity_object: weight vectors in the object's frame, shape (N, 3) [N].
        com_object: centers of mass, shape (N, 3) [m].
        depth: d_def of each jaw, shape (N, J) [m].
        force: closing forces, shape (N,) [N].
        friction: coefficients, shape (N,).
        cap: of the margin.
        length: torque scale [m].
        margins: shape (N,).
        reasons: codes, shape (N,).
        missing: bit j is set if jaw j has no contact, shape (N,).
        areas: of each jaw's patch, shape (N, J) [m^2].
    """
    jaws = len(pads.edges)
    space = make_workspace(jaws)
    normals = np.empty((jaws, 6))
    starts = np.empty(jaws + 1, np.int64)
    for n in range(len(margins)):
        T = T_object_gripper[n]
        to_com, gravity = to_wrench_frame(T, com_object[n], gravity_object[n])
        contacts, column, lost = 0, START, 0
        starts[0] = 0
        for jaw in range(jaws):
            T_pad = pads.T_gripper_pad[jaw]
            count, high, space = find_patch(
                mesh, pads, jaw, compose(T, T_pad), depth[n, jaw], space
            )
            area = 0.0
            if count > 0:
                column, area = contact_elements(
                    count,
                    high,
                    force[n],
                    friction[n],
                    compose(to_com, T_pad),
                    length,
                    space,
                    column,
                    normals[contacts],
                )
            areas[n, jaw] = area
            if area > 0.0:
                contacts += 1
                starts[contacts] = column
            else:
                lost |= 1 << jaw
        missing[n] = lost
        margins[n], reasons[n] = hold(
            min(2, jaws), normals[:contacts], space.points, starts[: contacts + 1], gravity, cap
        )
