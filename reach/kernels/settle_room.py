"""What the steps of the settled model hand to each other: the hand, its candidates, the arrays."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from reach.arrays import FloatArray, IntArray
from reach.kernels.compiling import compiled
from reach.kernels.elements import POINT
from reach.kernels.settle_contact import GROUPS, SUMS

SLACK = 3e-3
"""Motion that a list of candidate triangles allows for [m]."""


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
