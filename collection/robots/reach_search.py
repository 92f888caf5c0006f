"""Which poses an arm reaches: many poses at once, each from many starts.

A screening that plans can afford on hundreds of grasps; the motion itself is solved by mink
([collection.robots.inverse_kinematics][]), which starts from what is found here.
"""

from __future__ import annotations

import numpy as np

from collection.robots.chain_kernels import search_all
from collection.robots.kinematics import SerialChain
from reach.arrays import BoolArray, FloatArray
from reach.kernels.compiling import announce_compilation


def start_configurations(chain: SerialChain, home: FloatArray, count: int, seed: int) -> FloatArray:
    """Home and random configurations well inside the limits, shape (count, J) [rad]."""
    rng = np.random.default_rng(seed)
    middle, half = 0.5 * (chain.upper + chain.lower), 0.5 * (chain.upper - chain.lower)
    half = np.minimum(half, np.pi)
    random = middle + 0.8 * half * rng.uniform(-1, 1, (count - 1, len(chain)))
    return np.concatenate([home[None], random])


def solve_many(
    chain: SerialChain, T_base_tip: FloatArray, starts: FloatArray
) -> tuple[FloatArray, BoolArray]:
    """Damped least squares on every pair of pose and start.

    Args:
        chain: the arm.
        T_base_tip: targets, shape (N, 4, 4).
        starts: configurations, shape (S, J) [rad].

    Returns:
        Configurations (N, S, J) within the limits, and which of them reach their pose (N, S).
    """
    announce_compilation(search_all)
    targets = np.ascontiguousarray(T_base_tip)
    joints = np.empty((len(targets), len(starts), len(chain)))
    solved = np.empty(joints.shape[:2], dtype=bool)
    search_all(
        chain.T_parent_joint,
        chain.T_last_tip,
        chain.lower,
        chain.upper,
        targets,
        np.ascontiguousarray(starts),
        joints,
        solved,
    )
    return joints, solved
