"""Close, press, balance, settle, lift: the verdict on a grasp whose part may move, compiled.

Source of the parts: an elastic foundation (Winkler); quasi-static motion of a part under preload
and Coulomb friction, of the kind of [Goyal1991] and [Peshkin1988].
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from reach.arrays import FloatArray, IntArray
from reach.kernels.compiling import compiled
from reach.kernels.elements import POINT, wrench_in_frame
from reach.kernels.pads import Pads
from reach.kernels.patch import contact_depth
from reach.kernels.prism import NEVER, most_pieces
from reach.kernels.settle_balance import residual
from reach.kernels.settle_contact import GROUPS, SUMS, add_layer, friction_points_of
from reach.kernels.settle_motion import (
    closing_axis,
    motions_in_air,
    motions_on_table,
    moved,
    without_axis,
)
from reach.kernels.settle_press import (
    BACKING,
    DEEPEST,
    columns_of,
    gather,
    pieces_over_pad,
    press,
    pressed,
)
from reach.kernels.support import friction_support
from reach.kernels.tree import MeshTree
from reach.kernels.verdict import compose, to_wrench_frame

HELD, NO_CONTACT, SQUEEZED_OUT, MOVING_ON, SLIPPED = 0, 1, 2, 3, 4
"""How a grasp ends: held; a pad never met the part; the part moved off a pad while it settled; it
was still moving when the steps ran out; it slipped, or turned away, when lifted."""

BALANCED = 0.03
"""A residual below this part of the closing force is balanced."""
LONGEST_STEP = 6e-4
"""Of any point a torque scale from the center of mass [m]: 0.6 mm, 0.02 rad."""
SHORTEST_STEP = 5e-6
MOST_STEPS = 80
MOST_LIFT_STEPS = 80
SLACK = 3e-3
"""Motion that a list of candidate triangles allows for [m]."""
WEIGHT_SHARE = 0.1
"""Part of the weight that may stay unbalanced: the residual's rounding against a light part."""
FEATURES = 7
"""Columns (and one more a jaw) of what is known of a grasp besides its fate: 0 residual when settled [N], 1 and 2
translation [m] and rotation [rad] of the part until then, 3 preload over the most that friction
could oppose to it, 4 area of the lesser jaw's patch at the pad's deformable depth [m^2], 5 least
distance of a center of pressure from the pad's outline [m], 6 motion in the lift [m], 7 and on depth
that each pad is pressed in [m]."""
SETTLED, JAMMED, GONE, MOVING = 0, 1, 2, 3
"""How a slide ends: in balance; where no step would gain energy; off a pad; out of steps."""


class Candidates(NamedTuple):
    """One jaw's surface that may be pressed while the part moves by no more than SLACK."""

    listed: IntArray
    triangles: FloatArray
    normals: FloatArray
    columns: FloatArray


class Hand(NamedTuple):
    """What does not change while a grasp is judged.

    Attributes:
        com: center of mass, object frame, shape (3,) [m].
        force: closing force f_C [N].
        friction: coefficient mu.
        stiffness: k_w [N/m^3].
        length: torque scale [m].
    """

    com: FloatArray
    force: float
    friction: float
    stiffness: float
    length: float


class Room(NamedTuple):
    """Arrays that one thread reuses from grasp to grasp.

    Attributes:
        counts: pieces of each jaw, shape (J,).
        depths: of each pad's face [m], shape (J,).
        factors: of each jaw's pressures, shape (J,).
        firsts: contact depth of each jaw when its candidates were listed [m], shape (J,).
        areas: of each jaw's patch [m^2], shape (J,).
        centers: of pressure of each jaw, pad frame, shape (J, 3) [m].
        sums: of pressure by group.
        used: groups in use.
        points: friction points of all jaws.
        wrench: preload, shape (6,).
    """

    counts: IntArray
    depths: FloatArray
    factors: FloatArray
    firsts: FloatArray
    areas: FloatArray
    centers: FloatArray
    sums: FloatArray
    used: IntArray
    points: FloatArray
    wrench: FloatArray


@compiled
def make_room(jaws: int) -> Room:
    """Allocate the arrays of one thread."""
    return Room(
        np.zeros(jaws, np.int64),
        np.zeros(jaws),
        np.zeros(jaws),
        np.zeros(jaws),
        np.zeros(jaws),
        np.zeros((jaws, 3)),
        np.zeros((GROUPS, SUMS)),
        np.empty(GROUPS, np.int64),
        np.empty((POINT, jaws * GROUPS)),
        np.zeros(6),
    )


@compiled
def list_candidates(
    mesh: MeshTree, pads: Pads, jaw: int, T_object_gripper: FloatArray, room: Room
) -> Candidates:
    """Find one jaw's candidates; `room.firsts` is NEVER if its pad meets nothing."""
    T = compose(T_object_gripper, pads.T_gripper_pad[jaw])
    low, high = pads.ends[jaw, 0], pads.ends[jaw, 1]
    first = contact_depth(mesh, T, pads.edges[jaw], pads.boxes[jaw], low, high)
    room.firsts[jaw] = first
    deepest = first + DEEPEST * pads.max_deformation[jaw] if first < NEVER else low
    listed = gather(mesh, T, pads.boxes[jaw], low, deepest, SLACK)
    pieces = len(listed) * most_pieces(len(pads.edges[jaw]))
    return Candidates(
        listed, np.empty((pieces, 3, 3)), np.empty((pieces, 3)), np.empty((pieces, 4))
    )


@compiled
def press_jaw(
    mesh: MeshTree,
    pads: Pads,
    jaw: int,
    T_object_gripper: FloatArray,
    hand: Hand,
    found: Candidates,
    room: Room,
) -> float:
    """Press one pad on; returns its potential, energy less f_C times travel [J], or NEVER."""
    T = compose(T_object_gripper, pads.T_gripper_pad[jaw])
    limit = pads.max_deformation[jaw]
    high = room.firsts[jaw] + DEEPEST * limit + SLACK
    count = pieces_over_pad(
        mesh, found.listed, T, pads.edges[jaw], pads.ends[jaw, 0], high,
        found.triangles, found.normals,
    )  # fmt: skip
    room.counts[jaw] = count
    columns_of(count, found.triangles, found.columns)
    first = NEVER
    for t in range(count):
        first = min(first, found.columns[t, 1])
    if first > room.firsts[jaw] + SLACK:
        return NEVER
    depth, energy, factor = press(count, found.columns, hand.force, hand.stiffness, limit)
    room.depths[jaw], room.factors[jaw] = depth, factor
    return energy - hand.force * depth if factor < 1e6 else NEVER


@compiled
def preload(
    pads: Pads, T_frame_gripper: FloatArray, hand: Hand, found: list[Candidates], room: Room
) -> int:
    """Write preload wrench and friction points of all jaws; returns the number of points."""
    column = 0
    pushed, wrench = np.empty(6), np.empty(6)
    room.wrench[:] = 0.0
    for jaw in range(len(pads.edges)):
        one = found[jaw]
        T = compose(T_frame_gripper, pads.T_gripper_pad[jaw])
        pushed[:] = 0.0
        stiffness = hand.stiffness * room.factors[jaw]
        depth, limit = room.depths[jaw], pads.max_deformation[jaw]
        rows, area = add_layer(
            room.counts[jaw], one.triangles, one.normals, depth, stiffness,
            room.sums, room.used, 0, pushed,
        )  # fmt: skip
        if depth > room.firsts[jaw] - SLACK + limit:
            rows, _ = add_layer(
                room.counts[jaw], one.triangles, one.normals, depth - limit,
                BACKING * stiffness, room.sums, room.used, rows, pushed,
            )  # fmt: skip
        room.areas[jaw] = area
        total = 0.0
        room.centers[jaw] = 0.0
        for row in range(rows):
            m = room.sums[room.used[row]]
            total += m[0]
            for i in range(3):
                room.centers[jaw, i] += m[1 + i]
        if total > 0.0:
            room.centers[jaw] /= total
        wrench_in_frame(
            pushed[0], pushed[1], pushed[2], pushed[3], pushed[4], pushed[5], T, hand.length, wrench
        )
        room.wrench[:] += wrench
        column = friction_points_of(
            rows, room.used, room.sums, hand.friction, T, hand.length, room.points, column
        )
    return column


@compiled
def press_all(
    mesh: MeshTree,
    pads: Pads,
    T_object_gripper: FloatArray,
    hand: Hand,
    found: list[Candidates],
    room: Room,
) -> tuple[float, int]:
    """Press all pads on; returns their potential [J], and bit j set for each jaw without contact."""
    total, lost = 0.0, 0
    for jaw in range(len(pads.edges)):
        value = press_jaw(mesh, pads, jaw, T_object_gripper, hand, found[jaw], room)
        if value == NEVER:
            lost |= 1 << jaw
        else:
            total += value
    return total, lost


@compiled
def list_all(
    mesh: MeshTree, pads: Pads, T_object_gripper: FloatArray, room: Room
) -> list[Candidates]:
    """Find all jaws' candidates."""
    return [
        list_candidates(mesh, pads, jaw, T_object_gripper, room) for jaw in range(len(pads.edges))
    ]


@compiled
def reach_of(pads: Pads, T_frame_gripper: FloatArray) -> float:
    """Greatest distance of a pad's point from the center of mass [m]."""
    most = 0.0
    for jaw in range(len(pads.edges)):
        T = compose(T_frame_gripper, pads.T_gripper_pad[jaw])
        box = pads.boxes[jaw]
        wide = np.sqrt(max(box[0] ** 2, box[1] ** 2) + max(box[2] ** 2, box[3] ** 2))
        away = np.sqrt(T[0, 3] ** 2 + T[1, 3] ** 2 + T[2, 3] ** 2)
        most = max(most, away + wide + pads.max_deformation[jaw])
    return most


@compiled
def unbalanced(
    weight: FloatArray, share: float, seen: FloatArray, points: int, balanced: float, room: Room,
    result: FloatArray,
) -> float:  # fmt: skip
    """Residual of preload and a share of the weight [N]."""
    wrench = room.wrench.copy()
    for i in range(3):
        wrench[i] += share * weight[i]
    return residual(wrench, room.points, points, seen, balanced, result)


@compiled
def in_balance(
    weight: FloatArray, share: float, seen: FloatArray, points: int, hand: Hand, room: Room,
    result: FloatArray,
) -> tuple[bool, float]:  # fmt: skip
    """Whether friction balances the preload, and then carries a share of the weight as well.

    Returns:
        The answer, and the residual of both together, whose direction is written to `result`.
    """
    heavy = np.sqrt(weight[0] ** 2 + weight[1] ** 2 + weight[2] ** 2) * share
    enough = BALANCED * hand.force
    if heavy == 0.0:
        left = unbalanced(weight, 0.0, seen, points, enough, room, result)
        return left <= enough, left
    alone = unbalanced(weight, 0.0, seen, points, 0.5 * WEIGHT_SHARE * heavy, room, result)
    left = unbalanced(
        weight, share, seen, points, min(alone, enough) + WEIGHT_SHARE * heavy, room, result
    )
    return alone <= enough and left <= alone + WEIGHT_SHARE * heavy, left


@compiled
def slide(
    mesh: MeshTree,
    pads: Pads,
    T_object_gripper: FloatArray,
    weight: FloatArray,
    hand: Hand,
    motions: FloatArray,
    seen: FloatArray,
    most_steps: int,
    room: Room,
    path: FloatArray,
    step: int,
) -> tuple[FloatArray, int, int, int, float, int]:
    """Let the part move along what friction cannot balance, until it rests.

    A step is taken where it releases more energy (of the pads, and of the weight) than friction
    consumes on its way, and is halved until it does.

    Args:
        mesh: the part.
        pads: the gripper.
        T_object_gripper: where it starts, shape (4, 4).
        weight: in the gripper's axes, shape (3,) [N]; zero while the table carries it.
        hand: what does not change.
        motions: free twists, shape (M, 6).
        seen: the same as wrenches see them, shape (M, 6).
        most_steps: limit.
        room: of the thread.
        path: receives every pose T_object_gripper from row `step` on, or has no rows.
        step: number of poses in `path` so far.

    Returns:
        Pose in the end, how it ended (SETTLED, JAMMED, GONE, MOVING), bits of jaws without
        contact, number of friction points, residual [N], and number of poses in `path`.
    """
    T = T_object_gripper
    T_frame, _ = to_wrench_frame(T, hand.com, weight)
    reach = max(1.0, reach_of(pads, T_frame) / hand.length)
    found = list_all(mesh, pads, T, room)
    potential, lost = press_all(mesh, pads, T, hand, found, room)
    if step < len(path):
        path[step] = T
    step += 1
    if lost:
        return T, GONE, lost, 0, 0.0, step
    y, twist = np.zeros(len(motions)), np.empty(6)
    used, longest, points, left = 0.0, LONGEST_STEP, 0, 0.0
    for _ in range(most_steps):
        T_frame, _ = to_wrench_frame(T, hand.com, weight)
        points = preload(pads, T_frame, hand, found, room)
        rests, left = in_balance(weight, 1.0, seen, points, hand, room, y)
        if rests:
            return T, SETTLED, 0, points, left, step
        drive, heave = 0.0, 0.0  # power of preload and weight along the residual's direction
        twist[:] = 0.0
        for m in range(len(motions)):
            for i in range(6):
                twist[i] += motions[m, i] * y[m] / left
                drive += seen[m, i] * room.wrench[i] * y[m] / left
        for i in range(3):
            heave += weight[i] * twist[i]
        friction = max(0.0, drive + heave - left)
        length, taken = longest, False
        while length >= SHORTEST_STEP:
            if used + length * reach > SLACK:
                found, used = list_all(mesh, pads, T, room), 0.0
            after = moved(T, hand.com, length * twist, hand.length)
            value, lost = press_all(mesh, pads, after, hand, found, room)
            if lost and used > 0.0:  # the candidates may have run out, not the part
                found, used = list_all(mesh, pads, after, room), 0.0
                value, lost = press_all(mesh, pads, after, hand, found, room)
            if lost:
                if step < len(path):
                    path[step] = after
                return after, GONE, lost, 0, left, step + 1
            if value - potential <= length * (heave - friction):
                taken = True
                break
            length *= 0.4
        if not taken:
            press_all(mesh, pads, T, hand, found, room)
            return T, JAMMED, 0, points, left, step
        T, potential, used = after, value, used + length * reach
        longest = min(LONGEST_STEP, 2.0 * length)
        if step < len(path):
            path[step] = T
        step += 1
    return T, MOVING, 0, points, left, step


@compiled
def margin_of(
    weight: FloatArray, seen: FloatArray, points: int, hand: Hand, cap: float, room: Room
) -> float:
    """How many times the weight the settled contacts carry, up to a cap."""
    y = np.zeros(len(seen))
    if in_balance(weight, cap, seen, points, hand, room, y)[0]:
        return cap
    holds = in_balance(weight, 1.0, seen, points, hand, room, y)[0]
    low, high = (1.0, cap) if holds else (0.0, 1.0)
    for _ in range(6):
        middle = 0.5 * (low + high)
        if in_balance(weight, middle, seen, points, hand, room, y)[0]:
            low = middle
        else:
            high = middle
    return low if holds else min(low, 0.999)


@compiled
def describe(pads: Pads, hand: Hand, found: list[Candidates], room: Room, row: FloatArray) -> None:
    """Write features 4, 5, 7 and on: areas, distances to the outline, and depths."""
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


@compiled
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
    room = make_room(len(pads.edges))
    axis, common = closing_axis(pads.T_gripper_pad)
    in_air = motions_in_air(axis)
    seen_in_air = without_axis(in_air, axis, common)
    nothing = np.zeros(3)
    for n in range(len(margins)):
        hand = Hand(com_object[n], force[n], friction[n], stiffness, length)
        T0 = T_object_gripper[n]
        _, weight = to_wrench_frame(T0, hand.com, gravity_object[n])
        heavy = np.sqrt(weight[0] ** 2 + weight[1] ** 2 + weight[2] ** 2)
        on_table = motions_on_table(-weight / heavy, axis)
        seen = without_axis(on_table, axis, common)
        T, end, lost, points, left, step = slide(
            mesh, pads, T0, nothing, hand, on_table, seen, MOST_STEPS, room, path, 0
        )
        row = features[n]
        row[:] = 0.0
        row[0] = left
        row[1], row[2] = motion_between(T0, T, hand.com)
        lengths[0] = lengths[1] = step
        if end == GONE or end == MOVING:
            margins[n], missing[n] = 0.0, lost
            fates[n] = MOVING_ON if end == MOVING else (NO_CONTACT if step == 1 else SQUEEZED_OUT)
            continue
        row[3] = opposed(seen, points, room)
        T_rest = T
        describe(pads, hand, list_all_pressed(mesh, pads, T, hand, room), room, row)
        for jaw in range(len(pads.edges)):
            areas[n, jaw] = room.areas[jaw]
        T, end, lost, points, left, step = slide(
            mesh, pads, T, weight, hand, in_air, seen_in_air, MOST_LIFT_STEPS, room, path, step
        )
        lengths[1] = step
        travel, turn = motion_between(T_rest, T, hand.com)
        row[6] = travel + length * turn
        missing[n] = lost
        if end == GONE or end == MOVING:
            margins[n], fates[n] = 0.0, SLIPPED
            continue
        margins[n] = margin_of(weight, seen_in_air, points, hand, cap, room)
        # Where no motion gains energy the part hangs, whatever the rest of the residual says.
        margins[n] = max(1.0, margins[n])
        fates[n] = HELD


@compiled
def list_all_pressed(
    mesh: MeshTree, pads: Pads, T_object_gripper: FloatArray, hand: Hand, room: Room
) -> list[Candidates]:
    """Candidates of a pose, with its pads pressed on."""
    found = list_all(mesh, pads, T_object_gripper, room)
    press_all(mesh, pads, T_object_gripper, hand, found, room)
    return found


@compiled
def motion_between(A: FloatArray, B: FloatArray, com: FloatArray) -> tuple[float, float]:
    """Translation of the center of mass [m] and rotation [rad] of a part seen from the gripper.

    Args:
        A: T_object_gripper before, shape (4, 4).
        B: after.
        com: center of mass, object frame, shape (3,).
    """
    squares, trace = 0.0, 0.0
    for i in range(3):
        difference = 0.0
        for j in range(3):
            difference += B[j, i] * (com[j] - B[j, 3]) - A[j, i] * (com[j] - A[j, 3])
            trace += A[j, i] * B[j, i]
        squares += difference * difference
    return np.sqrt(squares), np.arccos(min(1.0, max(-1.0, 0.5 * (trace - 1.0))))
