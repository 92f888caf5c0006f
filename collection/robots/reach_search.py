"""Which poses an arm reaches: many poses at once, each from many starts.

A screening that plans can afford on hundreds of grasps; the motion itself is solved by mink
([collection.robots.inverse_kinematics][]), which starts from what is found here.
"""

from __future__ import annotations

import numpy as np

from collection.robots.kinematics import SerialChain
from reach.arrays import BoolArray, FloatArray

ITERATIONS = 60
DAMPING = 0.03
LONGEST_STEP = 0.5
"""Of any joint in one iteration [rad]."""
POSITION_TOLERANCE, ROTATION_TOLERANCE = 1e-4, 1e-3
CENTERING = 0.02
"""How strongly the redundant axis is drawn to the middle of the joint ranges."""


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
    n, s = len(T_base_tip), len(starts)
    targets = np.repeat(T_base_tip, s, axis=0)
    joints = np.tile(starts, (n, 1))
    solved = np.zeros(n * s, dtype=bool)
    open_ = np.arange(n * s)
    for _ in range(ITERATIONS):
        frames = chain.link_frames(joints[open_])
        error = tip_error(frames[:, -1], targets[open_])
        done = _within_tolerance(error)
        solved[open_[done]] = True
        open_, frames, error = open_[~done], frames[~done], error[~done]
        if not len(open_):
            break
        joints[open_] = _stepped(chain, joints[open_], frames, error)
    return joints.reshape(n, s, -1), solved.reshape(n, s)


def tip_error(T: FloatArray, T_target: FloatArray) -> FloatArray:
    """Error from poses to targets, base axes, rotation first, shape (N, 6).

    The rotation part is sin(angle) times the axis up to 90 degrees, stretched beyond, so that
    it vanishes only at the target.
    """
    columns = np.cross(T[:, :3, :3], T_target[:, :3, :3], axis=1).sum(axis=2) * 0.5
    trace = np.einsum("nij,nij->n", T[:, :3, :3], T_target[:, :3, :3])
    sine = np.linalg.norm(columns, axis=1)
    angle = np.arctan2(sine, 0.5 * (trace - 1.0))
    rotation = columns * np.where(sine > 1e-9, angle / np.maximum(sine, 1e-9), 1.0)[:, None]
    return np.concatenate([rotation, T_target[:, :3, 3] - T[:, :3, 3]], axis=1)


def _within_tolerance(error: FloatArray) -> BoolArray:
    rotation, position = np.linalg.norm(error[:, :3], axis=1), np.linalg.norm(error[:, 3:], axis=1)
    reached: BoolArray = (rotation < ROTATION_TOLERANCE) & (position < POSITION_TOLERANCE)
    return reached


def _stepped(
    chain: SerialChain, joints: FloatArray, frames: FloatArray, error: FloatArray
) -> FloatArray:
    """One damped step toward the targets, drawn to mid-range along the redundant axis."""
    J = chain.jacobian(frames)
    centering = CENTERING * (0.5 * (chain.lower + chain.upper) - joints)
    step = _damped_step(J, error, centering)
    # A joint that the step would push through its limit stays out of a second solution.
    blocked = (joints + step <= chain.lower) | (joints + step >= chain.upper)
    free = ~blocked
    step = free * _damped_step(J * free[:, None, :], error, centering * free)
    largest = np.abs(step).max(axis=1, keepdims=True)
    step *= np.minimum(1.0, LONGEST_STEP / np.maximum(largest, 1e-12))
    return np.clip(joints + step, chain.lower, chain.upper)


def _damped_step(J: FloatArray, error: FloatArray, centering: FloatArray) -> FloatArray:
    """Damping falls with the error: far off it tames singularities, near by it costs nothing."""
    Jt = np.swapaxes(J, -1, -2)
    damping = DAMPING * np.minimum(1.0, np.linalg.norm(error, axis=1)) + 1e-7
    gram = J @ Jt + damping[:, None, None] * np.eye(6)
    residual = error - (J @ centering[..., None])[..., 0]
    step: FloatArray = centering + (Jt @ np.linalg.solve(gram, residual[..., None]))[..., 0]
    return step
