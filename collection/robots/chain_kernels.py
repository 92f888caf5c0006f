"""Compiled kinematics of a serial arm and its numerical inverse; see `kinematics`, `reach_search`.

Arrays are named as in `collection.robots.kinematics.SerialChain`. All functions stand in this one
file or in `reach.kernels` on purpose: numba's cache notices changes of a function's own file, and
the folder of `compiled` those of the kernels, but no other callee's.
"""

from __future__ import annotations

import math

import numpy as np

from reach.arrays import BoolArray, FloatArray
from reach.kernels.cholesky import solve_definite
from reach.kernels.compiling import compiled

ITERATIONS = 60
DAMPING = 0.03
LONGEST_STEP = 0.5
"""Of any joint in one iteration [rad]."""
POSITION_TOLERANCE, ROTATION_TOLERANCE = 1e-4, 1e-3
CENTERING = 0.02
"""How strongly the redundant axis is drawn to the middle of the joint ranges."""


@compiled
def fill_frames(
    T_parent_joint: FloatArray, T_last_tip: FloatArray, joints: FloatArray, frames: FloatArray
) -> None:
    """Fill the poses T_base_link of all links, and last the tip's.

    Args:
        T_parent_joint: shape (J, 4, 4).
        T_last_tip: shape (4, 4).
        joints: shape (J,) [rad].
        frames: filled, shape (J + 1, 4, 4).
    """
    count = len(joints)
    for number in range(count):
        fixed = T_parent_joint[number]
        T = frames[number]
        if number == 0:
            T[:] = fixed
        else:
            _multiply(frames[number - 1], fixed, T)
        c, s = math.cos(joints[number]), math.sin(joints[number])
        for row in range(3):  # times a rotation about z
            x, y = T[row, 0], T[row, 1]
            T[row, 0] = x * c + y * s
            T[row, 1] = y * c - x * s
    _multiply(frames[count - 1], T_last_tip, frames[count])


@compiled
def _multiply(A: FloatArray, B: FloatArray, product: FloatArray) -> None:
    for row in range(4):
        for column in range(4):
            value = 0.0
            for k in range(4):
                value += A[row, k] * B[k, column]
            product[row, column] = value


@compiled
def fill_all_frames(
    T_parent_joint: FloatArray, T_last_tip: FloatArray, joints: FloatArray, frames: FloatArray
) -> None:
    """The same for many configurations: joints (N, J), frames (N, J + 1, 4, 4)."""
    for n in range(len(joints)):
        fill_frames(T_parent_joint, T_last_tip, joints[n], frames[n])


@compiled
def fill_jacobian(frames: FloatArray, J: FloatArray) -> None:
    """Fill the tip's Jacobian in the base's axes, rotation first.

    Args:
        frames: from `fill_frames`, shape (J + 1, 4, 4).
        J: filled, shape (6, J).
    """
    tip = frames[-1]
    for n in range(len(frames) - 1):
        ax, ay, az = frames[n, 0, 2], frames[n, 1, 2], frames[n, 2, 2]
        x = tip[0, 3] - frames[n, 0, 3]
        y = tip[1, 3] - frames[n, 1, 3]
        z = tip[2, 3] - frames[n, 2, 3]
        J[0, n], J[1, n], J[2, n] = ax, ay, az
        J[3, n], J[4, n], J[5, n] = ay * z - az * y, az * x - ax * z, ax * y - ay * x


@compiled
def fill_tip_error(T: FloatArray, T_target: FloatArray, error: FloatArray) -> None:
    """Fill the error from a pose to its target (6,), base axes, rotation first.

    The rotation part is sin(angle) times the axis up to 90 degrees, stretched beyond, so that
    it vanishes only at the target.
    """
    x = y = z = trace = 0.0
    for k in range(3):
        a0, a1, a2 = T[0, k], T[1, k], T[2, k]
        b0, b1, b2 = T_target[0, k], T_target[1, k], T_target[2, k]
        x += 0.5 * (a1 * b2 - a2 * b1)
        y += 0.5 * (a2 * b0 - a0 * b2)
        z += 0.5 * (a0 * b1 - a1 * b0)
        trace += a0 * b0 + a1 * b1 + a2 * b2
    sine = math.sqrt(x * x + y * y + z * z)
    stretch = 1.0
    if sine > 1e-9:
        stretch = math.atan2(sine, 0.5 * (trace - 1.0)) / sine
    error[0], error[1], error[2] = stretch * x, stretch * y, stretch * z
    for k in range(3):
        error[3 + k] = T_target[k, 3] - T[k, 3]


@compiled
def search_all(
    T_parent_joint: FloatArray,
    T_last_tip: FloatArray,
    lower: FloatArray,
    upper: FloatArray,
    targets: FloatArray,
    starts: FloatArray,
    joints: FloatArray,
    solved: BoolArray,
) -> None:
    """Damped least squares on every pair of target (N, 4, 4) and start (S, J).

    Args:
        T_parent_joint: of the chain, as are T_last_tip, lower and upper.
        T_last_tip: shape (4, 4).
        lower: shape (J,) [rad].
        upper: shape (J,) [rad].
        targets: T_base_tip.
        starts: configurations within the limits [rad].
        joints: filled, shape (N, S, J) [rad].
        solved: filled, shape (N, S).
    """
    count = len(lower)
    frames = np.empty((count + 1, 4, 4))
    J = np.empty((6, count))
    error = np.empty(6)
    for n in range(len(targets)):
        for s in range(len(starts)):
            q = joints[n, s]
            q[:] = starts[s]
            solved[n, s] = False
            for _ in range(ITERATIONS):
                fill_frames(T_parent_joint, T_last_tip, q, frames)
                fill_tip_error(frames[-1], targets[n], error)
                if _norm(error[:3]) < ROTATION_TOLERANCE and _norm(error[3:]) < POSITION_TOLERANCE:
                    solved[n, s] = True
                    break
                fill_jacobian(frames, J)
                _step(J, error, lower, upper, q)


@compiled
def _norm(vector: FloatArray) -> float:
    square = 0.0
    for value in vector:
        square += value * value
    return math.sqrt(square)


@compiled
def _step(
    J: FloatArray, error: FloatArray, lower: FloatArray, upper: FloatArray, q: FloatArray
) -> None:
    """One damped step toward the target, drawn to mid-range along the redundant axis."""
    count = len(q)
    free = np.ones(count)
    step = np.empty(count)
    _damped_step(J, error, lower, upper, q, free, step)
    # A joint that the step would push through its limit stays out of a second solution.
    for k in range(count):
        if q[k] + step[k] <= lower[k] or q[k] + step[k] >= upper[k]:
            free[k] = 0.0
    if free.min() == 0.0:
        _damped_step(J, error, lower, upper, q, free, step)
    shrink = min(1.0, LONGEST_STEP / max(np.abs(step).max(), 1e-12))
    for k in range(count):
        q[k] = min(max(q[k] + shrink * step[k], lower[k]), upper[k])


@compiled
def _damped_step(
    J: FloatArray,
    error: FloatArray,
    lower: FloatArray,
    upper: FloatArray,
    q: FloatArray,
    free: FloatArray,
    step: FloatArray,
) -> None:
    """Damping falls with the error: far off it tames singularities, near by it costs nothing."""
    damping = DAMPING * min(1.0, _norm(error)) + 1e-7
    gram = damping * np.eye(6)
    residual = error.copy()
    for k in range(len(q)):
        step[k] = free[k] * CENTERING * (0.5 * (lower[k] + upper[k]) - q[k])
        for row in range(6):
            residual[row] -= J[row, k] * step[k]
            for column in range(row + 1):
                gram[row, column] += free[k] * J[row, k] * J[column, k]
    weights = solve_definite(gram, residual)
    for k in range(len(q)):
        along = 0.0
        for row in range(6):
            along += J[row, k] * weights[row]
        step[k] += free[k] * along
