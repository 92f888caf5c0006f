"""All pads pressed on a part: what they touch, their potential, their preload and friction."""

from __future__ import annotations

import numpy as np

from reach.arrays import FloatArray
from reach.kernels.compiling import compiled, compiled_in_place
from reach.kernels.elements import START, wrench_in_frame
from reach.kernels.pads import Pads
from reach.kernels.patch import contact_depth
from reach.kernels.prism import NEVER, most_pieces
from reach.kernels.settle_contact import add_layer, friction_points_of
from reach.kernels.settle_press import (
    BACKING,
    DEEPEST,
    columns_of,
    gather,
    pieces_over_pad,
    press,
)
from reach.kernels.settle_room import SLACK, Candidates, Hand, Room
from reach.kernels.tree import MeshTree
from reach.kernels.verdict import compose

MOST_FACTOR = 1e6
"""Pressures to be raised by more than this are those of a pad that meets next to nothing."""


@compiled_in_place
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
def list_all(
    mesh: MeshTree, pads: Pads, T_object_gripper: FloatArray, room: Room
) -> list[Candidates]:
    """Find all jaws' candidates."""
    return [
        list_candidates(mesh, pads, jaw, T_object_gripper, room) for jaw in range(len(pads.edges))
    ]


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
    return energy - hand.force * depth if factor < MOST_FACTOR else NEVER


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
def preload_of(
    pads: Pads, jaw: int, T_frame_gripper: FloatArray, hand: Hand, one: Candidates, room: Room,
    column: int,
) -> int:  # fmt: skip
    """Add one jaw's preload to `room.wrench` and write its friction points from a column on.

    Returns:
        Column after the last one written.
    """
    pushed, wrench = np.zeros(6), np.empty(6)
    T = compose(T_frame_gripper, pads.T_gripper_pad[jaw])
    stiffness = hand.stiffness * room.factors[jaw]
    depth, limit = room.depths[jaw], pads.max_deformation[jaw]
    rows, room.areas[jaw] = add_layer(
        room.counts[jaw], one.triangles, one.normals, depth, stiffness,
        room.sums, room.used, START, pushed,
    )  # fmt: skip
    if depth > room.firsts[jaw] - SLACK + limit:
        rows, _ = add_layer(
            room.counts[jaw], one.triangles, one.normals, depth - limit,
            BACKING * stiffness, room.sums, room.used, rows, pushed,
        )  # fmt: skip
    total = 0.0
    for i in range(3):
        room.centers[jaw, i] = 0.0
    for row in range(rows):
        m = room.sums[room.used[row]]
        total += m[0]
        for i in range(3):
            room.centers[jaw, i] += m[1 + i]
    if total > 0.0:
        for i in range(3):
            room.centers[jaw, i] /= total
    wrench_in_frame(
        pushed[0], pushed[1], pushed[2], pushed[3], pushed[4], pushed[5], T, hand.length, wrench
    )
    for i in range(6):
        room.wrench[i] += wrench[i]
    return friction_points_of(
        rows, room.used, room.sums, hand.friction, T, hand.length, room.points, column
    )


@compiled_in_place
def preload(
    pads: Pads, T_frame_gripper: FloatArray, hand: Hand, found: list[Candidates], room: Room
) -> int:
    """Write preload wrench and friction points of all jaws; returns the number of points."""
    column = START
    room.wrench[:] = 0.0
    for jaw in range(len(pads.edges)):
        column = preload_of(pads, jaw, T_frame_gripper, hand, found[jaw], room, column)
    return column


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
