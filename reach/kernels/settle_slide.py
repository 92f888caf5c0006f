"""Settle: a part moves along what friction cannot balance, as long as that releases energy."""

from __future__ import annotations

import numpy as np

from reach.arrays import FloatArray
from reach.kernels.compiling import compiled, compiled_in_place
from reach.kernels.pads import Pads
from reach.kernels.settle_balance import residual
from reach.kernels.settle_motion import copy_pose, moved
from reach.kernels.settle_pads import list_all, preload, press_all, reach_of
from reach.kernels.settle_room import SLACK, Hand, Room
from reach.kernels.tree import MeshTree
from reach.kernels.verdict import to_wrench_frame

SETTLED, JAMMED, GONE, MOVING = 0, 1, 2, 3
"""How a slide ends: in balance; where no step would gain energy; off a pad; out of steps."""
BALANCED = 0.03
"""A residual below this part of the closing force is balanced."""
WEIGHT_SHARE = 0.1
"""Part of the weight that may stay unbalanced: the residual's rounding against a light part."""
LONGEST_STEP = 6e-4
"""Of any point a torque scale from the center of mass [m]: 0.6 mm, 0.02 rad."""
SHORTEST_STEP = 5e-6
SHORTER = 0.4
"""A step that gains no energy is tried again at this part of its length."""
MOST_STEPS = 80


@compiled_in_place
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


@compiled_in_place
def way_out(
    motions: FloatArray, seen: FloatArray, weight: FloatArray, y: FloatArray, left: float,
    room: Room, twist: FloatArray,
) -> float:  # fmt: skip
    """Write the unit twist along the residual; returns the energy the pads must release on it.

    Args:
        motions: free twists, shape (M, 6).
        seen: the same as wrenches see them, shape (M, 6).
        weight: gripper's axes, shape (3,) [N].
        y: residual along each motion, shape (M,).
        left: its length [N].
        room: holds the preload.
        twist: receives the direction, shape (6,).

    Returns:
        What friction consumes less what the weight gives, per length [N].
    """
    drive, heave = 0.0, 0.0  # power of preload and of weight along the residual's direction
    twist[:] = 0.0
    for m in range(len(motions)):
        for i in range(6):
            twist[i] += motions[m, i] * y[m] / left
            drive += seen[m, i] * room.wrench[i] * y[m] / left
    for i in range(3):
        heave += weight[i] * twist[i]
    return max(0.0, drive + heave - left) - heave


@compiled
def slide(
    mesh: MeshTree,
    pads: Pads,
    T_object_gripper: FloatArray,
    weight: FloatArray,
    hand: Hand,
    motions: FloatArray,
    seen: FloatArray,
    room: Room,
    path: FloatArray,
    step: int,
) -> tuple[FloatArray, int, int, int, float, int]:
    """Let the part move along what friction cannot balance, until it rests.

    A step is taken where it releases more energy (of the pads, and of the weight) than friction
    consumes on its way, and is shortened until it does.

    Args:
        mesh: the part.
        pads: the gripper.
        T_object_gripper: where it starts, shape (4, 4).
        weight: in the gripper's axes, shape (3,) [N]; zero while the table carries it.
        hand: what does not change.
        motions: free twists, shape (M, 6).
        seen: the same as wrenches see them, shape (M, 6).
        room: of the thread.
        path: receives every later pose T_object_gripper from row `step` on, or has no rows.
        step: number of poses so far.

    Returns:
        Pose in the end, how it ended (SETTLED, JAMMED, GONE, MOVING), bits of jaws without
        contact, number of friction points, residual [N], and number of poses so far.
    """
    T = T_object_gripper
    T_frame, _ = to_wrench_frame(T, hand.com, weight)
    reach = max(1.0, reach_of(pads, T_frame) / hand.length)
    most = min(LONGEST_STEP, 0.5 * SLACK / reach)
    found = list_all(mesh, pads, T, room)
    potential, lost = press_all(mesh, pads, T, hand, found, room)
    if lost:
        return T, GONE, lost, 0, 0.0, step
    y, twist = np.zeros(len(motions)), np.empty(6)
    used, longest, points, left = 0.0, most, 0, 0.0
    for _ in range(MOST_STEPS):
        T_frame, _ = to_wrench_frame(T, hand.com, weight)
        points = preload(pads, T_frame, hand, found, room)
        rests, left = in_balance(weight, 1.0, seen, points, hand, room, y)
        if rests:
            return T, SETTLED, 0, points, left, step
        cost = way_out(motions, seen, weight, y, left, room, twist)
        length, after, value = longest, T, potential
        while length >= SHORTEST_STEP:
            if used + length * reach > SLACK:
                found, used = list_all(mesh, pads, T, room), 0.0
            after = moved(T, hand.com, twist, length, hand.length)
            value, lost = press_all(mesh, pads, after, hand, found, room)
            if lost and used > 0.0:  # the candidates may have run out, not the part
                found, used = list_all(mesh, pads, after, room), 0.0
                value, lost = press_all(mesh, pads, after, hand, found, room)
            if lost or value - potential <= -length * cost:
                break
            length *= SHORTER
        if length < SHORTEST_STEP:
            press_all(mesh, pads, T, hand, found, room)
            return T, JAMMED, 0, points, left, step
        T, potential, used = after, value, used + length * reach
        longest = min(most, 2.0 * length)
        if step < len(path):
            copy_pose(T, path[step])
        step += 1
        if lost:
            return T, GONE, lost, 0, left, step
    return T, MOVING, 0, points, left, step


@compiled_in_place
def margin_of(
    weight: FloatArray, seen: FloatArray, points: int, hand: Hand, cap: float, room: Room
) -> float:
    """How many times the weight contacts in balance carry, from once up to a cap."""
    y = np.zeros(len(seen))
    if in_balance(weight, cap, seen, points, hand, room, y)[0]:
        return max(cap, 1.0)
    low, high = 1.0, cap
    for _ in range(6):
        middle = 0.5 * (low + high)
        if in_balance(weight, middle, seen, points, hand, room, y)[0]:
            low = middle
        else:
            high = middle
    return max(low, 1.0)
