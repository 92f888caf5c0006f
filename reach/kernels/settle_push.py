"""One jaw first: a jaw pushes the part over the table until the other jaw touches too.

A part on a table is pushed at a point or along an edge, and turns. The forces that resist it, friction
on the table when it is slow and inertia when it is fast, are taken for an ellipsoid with the
part's radius of gyration k about the vertical: the twist is proportional to the force that
pushes, torque over k ([Goyal1991] Sect. 5, [Peshkin1988]). Friction across the pad is left out: a
light part is knocked ahead of the pad and does not stick to it (docs/decisions/0094).

Sources:
    [Goyal1991] Goyal, Ruina, Papadopoulos, Planar sliding with dry friction, Wear 143, 1991.
    [Peshkin1988] Peshkin, Sanderson, The motion of a pushed, sliding workpiece, IEEE J. Robotics
    and Automation 4, 1988.
"""

from __future__ import annotations

import numpy as np

from reach.arrays import FloatArray
from reach.kernels.compiling import compiled
from reach.kernels.elements import START
from reach.kernels.pads import Pads
from reach.kernels.settle_motion import copy_pose, moved
from reach.kernels.settle_pads import list_all, preload_of, press_all
from reach.kernels.settle_room import SLACK, Hand, Room
from reach.kernels.tree import MeshTree
from reach.kernels.verdict import to_wrench_frame

PUSH_FORCE = 0.2
"""Force of a pad that pushes [N]: a few times what a part of 10 g on a table resists with, far below
what presses a pad in."""
LONGEST_PUSH = 1e-3
"""Motion of the part in one step [m]; rotation counts times the radius of gyration."""
MOST_PUSHES = 60
TOUCHING = 5e-5
"""Jaws that are this near to touching together do [m]."""
LEVEL = 0.5
"""A closing axis with a smaller part along the table pushes the part nowhere."""
CALMER, LIVELIER = 0.3, 1.5
"""Factors of the rotation in one step after it changed its sense, and after it did not: a part
that comes flush with the pad would otherwise rock about it."""


@compiled
def push(
    mesh: MeshTree,
    pads: Pads,
    T_object_gripper: FloatArray,
    hand: Hand,
    motions: FloatArray,
    gyration: float,
    room: Room,
    path: FloatArray,
    step: int,
) -> tuple[FloatArray, int]:
    """Push a part until both jaws touch it, or close on nothing.

    Args:
        mesh: the part.
        pads: the gripper, two jaws that close along one axis.
        T_object_gripper: where the part starts, shape (4, 4).
        hand: what does not change.
        motions: slide across the closing axis, slide along it, yaw; shape (3, 6).
        gyration: radius about the vertical through the center of mass [m].
        room: of the thread.
        path: receives every later pose from row `step` on, or has no rows.
        step: number of poses so far.

    Returns:
        Pose in the end, and number of poses so far.
    """
    T = T_object_gripper
    light = Hand(hand.com, PUSH_FORCE, 0.0, hand.stiffness, hand.length)
    found, used = list_all(mesh, pads, T, room), 0.0
    gain, last = 1.0, 0.0
    arm, q = hand.length / gyration, np.empty(3)
    for _ in range(MOST_PUSHES):
        _, lost = press_all(mesh, pads, T, light, found, room)
        if lost and used > 0.0:  # the candidates may have run out, not the part
            found, used = list_all(mesh, pads, T, room), 0.0
            _, lost = press_all(mesh, pads, T, light, found, room)
        first = first_jaw(lost, room)
        left = way_left(pads, first, lost, room)
        if left < TOUCHING:
            break
        T_frame, _ = to_wrench_frame(T, hand.com, np.zeros(3))
        room.wrench[:] = 0.0
        preload_of(pads, first, T_frame, light, found[first], room, START)
        pushed_twist(motions, room.wrench, arm, gain, q)
        gain = gain * CALMER if q[2] * last < 0.0 else min(1.0, gain * LIVELIER)
        last = q[2]
        size = np.sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2])
        if not size > 0.0:  # what the pad touches is too small, or too steep, to be pressed
            break
        length = min(left, LONGEST_PUSH / size)
        twist = np.zeros(6)
        for i in range(6):
            twist[i] = q[0] * motions[0, i] + q[1] * motions[1, i]
            twist[i] += q[2] * arm * motions[2, i]
        used += 2.0 * length * size
        if used > SLACK:
            found, used = list_all(mesh, pads, T, room), 2.0 * length * size
        T = moved(T, hand.com, twist, length, hand.length)
        if step < len(path):
            copy_pose(T, path[step])
        step += 1
    return T, step


@compiled
def first_jaw(lost: int, room: Room) -> int:
    """The jaw that touches first; `lost` has bit j set if jaw j meets nothing."""
    if lost == 1 or (lost == 0 and room.depths[1] < room.depths[0]):
        return 1
    return 0


@compiled
def way_left(pads: Pads, first: int, lost: int, room: Room) -> float:
    """How far the first jaw pushes until the other one touches, or both meet in the middle [m]."""
    if lost == 3:
        return 0.0
    if lost == 0:
        return 0.5 * float(room.depths[1 - first] - room.depths[first])
    return float(0.5 * pads.ends[first, 1] - room.depths[first])


@compiled
def pushed_twist(
    motions: FloatArray, wrench: FloatArray, arm: float, gain: float, q: FloatArray
) -> None:
    """Find how a part moves while a pad that pushes it travels a unit of length.

    With n the generalized direction of the pressure, the motion is along n, and of unit travel:
    n . q = 1.

    Args:
        motions: see [push][reach.kernels.settle_push.push].
        wrench: of the pad's pressure, torques scaled, shape (6,).
        arm: torque scale over the radius of gyration.
        gain: part of the rotation to take.
        q: receives slide across, slide along, and yaw times the radius, shape (3,); zeros if the
            pad does not press.
    """
    n = np.zeros(3)
    for m in range(3):
        for i in range(6):
            n[m] += motions[m, i] * wrench[i] / PUSH_FORCE
    n[2] *= arm
    travel = n[0] * n[0] + n[1] * n[1] + gain * n[2] * n[2]
    q[0], q[1], q[2] = n[0], n[1], gain * n[2]
    for i in range(3):
        q[i] = q[i] / travel if travel > 0.0 else 0.0


@compiled
def spread_about(mesh: MeshTree, com: FloatArray) -> FloatArray:
    """Second moments of the surface about a point, per area, shape (3, 3) [m^2]."""
    result, total, c = np.zeros((3, 3)), 0.0, np.empty((3, 3))
    for t in range(len(mesh.corners)):
        for k in range(3):
            for i in range(3):
                c[k, i] = mesh.corners[t, k, i] - com[i]
        ux, uy, uz = c[1, 0] - c[0, 0], c[1, 1] - c[0, 1], c[1, 2] - c[0, 2]
        vx, vy, vz = c[2, 0] - c[0, 0], c[2, 1] - c[0, 1], c[2, 2] - c[0, 2]
        x, y, z = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
        area = 0.5 * np.sqrt(x * x + y * y + z * z)
        total += area
        for i in range(3):
            for j in range(3):
                value = (c[0, i] + c[1, i] + c[2, i]) * (c[0, j] + c[1, j] + c[2, j])
                for k in range(3):
                    value += c[k, i] * c[k, j]
                result[i, j] += area * value / 12.0
    for i in range(3):
        for j in range(3):
            result[i, j] /= total
    return result


@compiled
def gyration_about(spread: FloatArray, up_object: FloatArray) -> float:
    """Radius of gyration about an axis through the center of mass [m]."""
    square = 0.0
    for i in range(3):
        square += spread[i, i]
        for j in range(3):
            square -= up_object[i] * spread[i, j] * up_object[j]
    return float(np.sqrt(square))
