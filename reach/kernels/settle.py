"""Close, push, press, balance, settle, lift: the verdict on a grasp whose part may move, compiled.

Source of the parts: an elastic foundation (Winkler); quasi-static motion of a part under preload
and Coulomb friction, of the kind of [Goyal1991] and [Peshkin1988].
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from reach.arrays import FloatArray, IntArray
from reach.kernels.compiling import compiled, compiled_in_place
from reach.kernels.pads import Pads
from reach.kernels.settle_motion import (
    closing_axis,
    copy_pose,
    motion_between,
    motions_in_air,
    motions_on_table,
    without_axis,
)
from reach.kernels.settle_pads import list_all, press_all
from reach.kernels.settle_press import pressed
from reach.kernels.settle_push import LEVEL, MOST_PUSHES, gyration_about, push, spread_about
from reach.kernels.settle_room import Candidates, Hand, Room, make_room
from reach.kernels.settle_slide import GONE, JAMMED, MOST_STEPS, MOVING, margin_of, slide
from reach.kernels.support import friction_support
from reach.kernels.tree import MeshTree
from reach.kernels.verdict import to_wrench_frame

HELD, NO_CONTACT, SQUEEZED_OUT, MOVING_ON, SLIPPED, STUCK = 0, 1, 2, 3, 4, 5
"""How a grasp ends: held, in balance; a pad never met the part; the part moved off a pad while it
settled; it was still moving when the steps ran out; it slipped, or turned away, when lifted; it
is stuck between the pads: out of balance, and yet no motion releases energy."""

FEATURES = 8
"""Columns (and one more a jaw) of what is known of a grasp besides its fate: 0 residual in the end [N], 1 and 2 translation [m] and rotation [rad] of the part until then, 3 preload over the most that
friction could oppose to it, 4 area of the lesser jaw's patch at the pad's deformable depth [m^2],
5 least distance of a center of pressure from the pad's outline [m], 6 motion in the lift [m],
7 translation while one jaw alone pushed [m], 8 and on depth that each pad is pressed in [m]."""
MOST_POSES = 1 + MOST_PUSHES + 2 * MOST_STEPS
"""Of a path."""


class Ways(NamedTuple):
    """How a gripper lets a part move.

    Attributes:
        axis: along which its jaws close, gripper frame, shape (3,).
        common: whether all of them do.
        in_air: free twists of a part that hangs, shape (6, 6).
        seen_in_air: the same as wrenches see them.
        spread: second moments of the part's surface, object frame, shape (3, 3) [m^2].
    """

    axis: FloatArray
    common: bool
    in_air: FloatArray
    seen_in_air: FloatArray
    spread: FloatArray


@compiled
def ways_of(mesh: MeshTree, pads: Pads, com: FloatArray) -> Ways:
    """Find how a gripper lets a part move."""
    axis, common = closing_axis(pads.T_gripper_pad)
    in_air = motions_in_air(axis)
    seen = without_axis(in_air, axis, common)
    return Ways(axis, common, in_air, seen, spread_about(mesh, com))


@compiled_in_place
def close(
    mesh: MeshTree, pads: Pads, T_object_gripper: FloatArray, up_object: FloatArray, hand: Hand,
    ways: Ways, room: Room, path: FloatArray,
) -> tuple[FloatArray, int, FloatArray]:  # fmt: skip
    """Close the jaws until all of them touch.

    Returns:
        Pose of the gripper in the part, number of poses in `path`, and the motions that are left
        on the table: where the jaws' travel decides how far along the table the part is, it can
        only slide across and yaw.
    """
    T = T_object_gripper
    up = np.zeros(3)
    for i in range(3):
        for j in range(3):
            up[i] += T[j, i] * up_object[j]
    motions = motions_on_table(up, ways.axis)
    level = 0.0
    for i in range(3):
        level += motions[1, i] * ways.axis[i]
    if len(path):
        copy_pose(T, path[0])
    if not ways.common or len(pads.edges) != 2 or abs(level) < LEVEL:
        return T, 1, motions
    T, step = push(
        mesh, pads, T, hand, motions, gyration_about(ways.spread, up_object), room, path, 1
    )
    left = np.empty((2, 6))
    for i in range(6):
        left[0, i], left[1, i] = motions[0, i], motions[2, i]
    return T, step, left


@compiled_in_place
def judge_one(
    mesh: MeshTree, pads: Pads, T_object_gripper: FloatArray, gravity_object: FloatArray,
    hand: Hand, ways: Ways, cap: float, room: Room, areas: FloatArray, row: FloatArray,
    path: FloatArray, lengths: IntArray,
) -> tuple[float, int, int]:  # fmt: skip
    """Judge one grasp; arguments as for [judge_settling][reach.kernels.settle.judge_settling].

    Returns:
        Margin, fate, and bits of jaws without contact in the end.
    """
    T0, com = T_object_gripper, hand.com
    row[:] = 0.0
    _, weight = to_wrench_frame(T0, com, gravity_object)
    heavy, up = np.sqrt(weight[0] ** 2 + weight[1] ** 2 + weight[2] ** 2), np.empty(3)
    for i in range(3):
        up[i] = -gravity_object[i] / heavy

    T, step, on_table = close(mesh, pads, T0, up, hand, ways, room, path)
    row[7], _ = motion_between(T0, T, com)
    closed = step

    seen = without_axis(on_table, ways.axis, ways.common)
    T_rest, end, lost, points, row[0], step = slide(
        mesh, pads, T, np.zeros(3), hand, on_table, seen, room, path, step
    )
    row[1], row[2] = motion_between(T0, T_rest, com)
    lengths[:] = step
    if end == GONE:
        return 0.0, NO_CONTACT if step == closed else SQUEEZED_OUT, lost
    if end == MOVING:
        return 0.0, MOVING_ON, lost
    row[3] = opposed(seen, points, room)
    found = list_all(mesh, pads, T_rest, room)
    press_all(mesh, pads, T_rest, hand, found, room)
    describe(pads, found, room, row)
    for jaw in range(len(areas)):
        areas[jaw] = room.areas[jaw]

    T, end, lost, points, row[0], lengths[1] = slide(
        mesh, pads, T_rest, weight, hand, ways.in_air, ways.seen_in_air, room, path, step
    )
    travel, turn = motion_between(T_rest, T, com)
    row[6] = travel + hand.length * turn
    if end == GONE or end == MOVING:
        return 0.0, SLIPPED, lost
    if end == JAMMED:  # it hangs, but how much more than its weight would hang is not known
        return 1.0, STUCK, 0
    return margin_of(weight, ways.seen_in_air, points, hand, cap, room), HELD, 0


@compiled_in_place
def describe(pads: Pads, found: list[Candidates], room: Room, row: FloatArray) -> None:
    """Write features 4, 5, 8 and on: areas, distances to the outline, and depths."""
    row[4], row[5] = np.inf, np.inf
    for jaw in range(len(pads.edges)):
        one = found[jaw]
        first = np.inf
        for t in range(room.counts[jaw]):
            first = min(first, one.columns[t, 1])
        row[FEATURES + jaw] = room.depths[jaw] - first
        area, _, _ = pressed(room.counts[jaw], one.columns, first + pads.max_deformation[jaw])
        row[4] = min(row[4], area)
        for edge in range(len(pads.edges[jaw])):
            a, b, c = pads.edges[jaw, edge]
            if a != 0.0 or b != 0.0:
                inside = c - a * room.centers[jaw, 0] - b * room.centers[jaw, 1]
                row[5] = min(row[5], inside)


@compiled_in_place
def opposed(seen: FloatArray, points: int, room: Room) -> float:
    """Preload over the most that friction could oppose to it in its own direction."""
    d, new = np.zeros(6), np.zeros(6)
    size = 0.0
    for m in range(len(seen)):
        value = 0.0
        for i in range(6):
            value += seen[m, i] * room.wrench[i]
        size += value * value
        for i in range(6):
            d[i] -= seen[m, i] * value
    size = float(np.sqrt(size))
    if size < 1e-9:
        return 0.0
    for i in range(6):
        d[i] /= size
    most = friction_support(room.points, 0, points, d, new)
    return size / max(most, 1e-9)


@compiled
def same(a: FloatArray, b: FloatArray) -> bool:
    """Whether two points are equal."""
    return bool(a[0] == b[0] and a[1] == b[1] and a[2] == b[2])


@compiled
def judge_settling(
    mesh: MeshTree,
    pads: Pads,
    T_object_gripper: FloatArray,
    gravity_object: FloatArray,
    com_object: FloatArray,
    force: FloatArray,
    friction: FloatArray,
    stiffness: float,
    cap: float,
    length: float,
    margins: FloatArray,
    fates: IntArray,
    missing: IntArray,
    areas: FloatArray,
    features: FloatArray,
    path: FloatArray,
    lengths: IntArray,
) -> None:
    """Judge many grasps; results are written to the last seven arrays.

    Args:
        mesh: the part.
        pads: the gripper.
        T_object_gripper: shape (N, 4, 4).
        gravity_object: weight vectors in the object's frame, shape (N, 3) [N].
        com_object: centers of mass, shape (N, 3) [m].
        force: closing forces, shape (N,) [N].
        friction: coefficients, shape (N,).
        stiffness: k_w [N/m^3].
        cap: of the margin.
        length: torque scale [m].
        margins: shape (N,).
        fates: codes, shape (N,).
        missing: bit j is set if jaw j has no contact in the end, shape (N,).
        areas: of each jaw's patch, shape (N, J) [m^2].
        features: shape (N, FEATURES + J).
        path: poses T_object_gripper of the last grasp, shape (P, 4, 4), or (0, 4, 4).
        lengths: of the path: poses until the part rests on the table, and in all, shape (2,).
    """
    if len(margins) == 0:
        return
    room = make_room(len(pads.edges))
    ways = ways_of(mesh, pads, com_object[0])
    for n in range(len(margins)):
        if n > 0 and not same(com_object[n], com_object[n - 1]):
            ways = ways_of(mesh, pads, com_object[n])
        hand = Hand(com_object[n], force[n], friction[n], stiffness, length)
        margins[n], fates[n], missing[n] = judge_one(
            mesh, pads, T_object_gripper[n], gravity_object[n], hand, ways, cap, room,
            areas[n], features[n], path, lengths,
        )  # fmt: skip
