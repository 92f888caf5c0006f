"""Where a fixed camera stands: from views of a chessboard that the gripper holds, or that lies still.

With the board in the gripper two poses are unknown: T_world_camera (X) and T_gripper_board (Y).
Every view tells T_world_gripper Y = X T_camera_board. Between two views X cancels, which leaves
A Y = Y B: its rotation is solved by aligning rotation vectors, its translation by linear least
squares [Park1994]. Both poses are then refined together on the corners' reprojection error.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np
from scipy.optimize import least_squares

from collection.calibration.chessboard import Board, board_pose, project
from collection.errors import CalibrationError
from reach.arrays import FloatArray, frozen
from reach.transforms import (
    apply,
    exp,
    inverse,
    make_transform,
    project_to_rotation,
    rotation_angle,
    rotation_log,
)
from registration.frame import Intrinsics

FEWEST_VIEWS = 4
LEAST_TURN = 0.15
"""The board must have been turned about two axes by at least this much [rad]."""


@dataclass(frozen=True, slots=True, eq=False)
class View:
    """One image of the board.

    Args:
        name: for messages and residuals.
        corners: of the board in the image, shape (N, 2) [pixel].
        T_world_carrier: pose of what carries the board: the gripper, or, for a board that lies
            still, the board's own known pose; shape (4, 4).
    """

    name: str
    corners: FloatArray
    T_world_carrier: FloatArray


@dataclass(frozen=True, slots=True, eq=False)
class HandEye:
    """A solved calibration.

    Args:
        T_world_camera: shape (4, 4).
        T_carrier_board: how the carrier holds the board, shape (4, 4).
        reprojection: root mean square of every view, shape (V,) [pixel].
        translation: distance between the board seen and the board carried, shape (V,) [m].
        rotation: angle between them, shape (V,) [rad].
        position_std: standard deviation of the camera's position, from the fit [m].
        rotation_std: of its rotation, from the fit [rad].
    """

    T_world_camera: FloatArray
    T_carrier_board: FloatArray
    reprojection: FloatArray
    translation: FloatArray
    rotation: FloatArray
    position_std: float
    rotation_std: float


def solve_gripper_board(views: Sequence[View], board: Board, camera: Intrinsics) -> HandEye:
    """Calibrate with a board that the gripper holds and shows in many poses.

    Raises:
        CalibrationError: fewer than four views, or the board was turned about one axis only.
    """
    if len(views) < FEWEST_VIEWS:
        raise CalibrationError(f"{len(views)} views of the board, at least {FEWEST_VIEWS} needed")
    seen = np.array([board_pose(view.corners, board, camera) for view in views])
    carried = np.array([view.T_world_carrier for view in views])
    Y = _carrier_board(carried, seen)
    X = _mean_pose(carried @ Y @ inverse(seen))
    return _refined(views, board, camera, X, Y, fixed=False)


def solve_fixed_board(views: Sequence[View], board: Board, camera: Intrinsics) -> HandEye:
    """Calibrate with a board that lies at a known pose; one view is enough.

    Raises:
        CalibrationError: no view.
    """
    if not views:
        raise CalibrationError("no view of the board")
    seen = np.array([board_pose(view.corners, board, camera) for view in views])
    carried = np.array([view.T_world_carrier for view in views])
    X = _mean_pose(carried @ inverse(seen))
    return _refined(views, board, camera, X, make_transform(), fixed=True)


def _carrier_board(carried: FloatArray, seen: FloatArray) -> FloatArray:
    """Closed form of A Y = Y B over all pairs of views [Park1994]."""
    pairs = list(combinations(range(len(carried)), 2))
    A = np.array([inverse(carried[j]) @ carried[i] for i, j in pairs])
    B = np.array([inverse(seen[j]) @ seen[i] for i, j in pairs])
    alpha = np.array([rotation_log(T[:3, :3]) for T in A])
    beta = np.array([rotation_log(T[:3, :3]) for T in B])
    _, spread, _ = np.linalg.svd(alpha, full_matrices=False)
    if spread[1] / np.sqrt(len(pairs)) < LEAST_TURN:
        raise CalibrationError(
            "the views turn the board about one axis only: show it turned about two or three"
        )
    rotation = project_to_rotation(alpha.T @ beta)
    # R_A t + t_A = R_Y t_B + t
    left = (A[:, :3, :3] - np.eye(3)).reshape(-1, 3)
    right = (B[:, :3, 3] @ rotation.T - A[:, :3, 3]).reshape(-1)
    translation = np.linalg.lstsq(left, right, rcond=None)[0]
    return make_transform(rotation, translation)


def _mean_pose(poses: FloatArray) -> FloatArray:
    rotation = project_to_rotation(poses[:, :3, :3].mean(axis=0))
    return make_transform(rotation, poses[:, :3, 3].mean(axis=0))


def _refined(
    views: Sequence[View],
    board: Board,
    camera: Intrinsics,
    X: FloatArray,
    Y: FloatArray,
    *,
    fixed: bool,
) -> HandEye:
    """Least squares on the reprojection of every corner; Y stays as it is if `fixed`."""
    points, corners = board.corners_board(), np.array([view.corners for view in views])
    carriers = [view.T_world_carrier for view in views]

    def poses(step: FloatArray) -> tuple[FloatArray, FloatArray]:
        return X @ exp(step[:6]), Y if fixed else Y @ exp(step[6:])

    def errors(step: FloatArray) -> FloatArray:
        T_world_camera, T_carrier_board = poses(step)
        T_camera_world = inverse(T_world_camera)
        seen = [
            project(apply(T_camera_world @ carrier @ T_carrier_board, points), camera)
            for carrier in carriers
        ]
        return np.asarray((np.array(seen) - corners).ravel())

    fit = least_squares(errors, np.zeros(6 if fixed else 12), x_scale="jac", method="lm")
    T_world_camera, T_carrier_board = poses(fit.x)
    residual = fit.fun.reshape(len(views), -1)
    rotation_std, position_std = _deviations(np.asarray(fit.jac), fit.fun)
    translation, rotation = _disagreement(views, board, camera, T_world_camera, T_carrier_board)
    return HandEye(
        frozen(T_world_camera),
        frozen(T_carrier_board),
        frozen(np.sqrt(2 * np.mean(residual**2, axis=1))),
        translation,
        rotation,
        position_std,
        rotation_std,
    )


def _deviations(J: FloatArray, errors: FloatArray) -> tuple[float, float]:
    """Standard deviations of the camera's rotation and position, from the fit's normal matrix."""
    freedom = max(1, errors.size - J.shape[1])
    covariance = np.linalg.pinv(J.T @ J) * float(errors @ errors) / freedom
    return (
        float(np.sqrt(np.trace(covariance[:3, :3]))),
        float(np.sqrt(np.trace(covariance[3:6, 3:6]))),
    )


def _disagreement(
    views: Sequence[View], board: Board, camera: Intrinsics, X: FloatArray, Y: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """How far the board seen alone is from the board carried, by view [m], [rad]."""
    deltas = [
        inverse(view.T_world_carrier @ Y) @ X @ board_pose(view.corners, board, camera)
        for view in views
    ]
    return (
        frozen([np.linalg.norm(T[:3, 3]) for T in deltas]),
        frozen([rotation_angle(T[:3, :3]) for T in deltas]),
    )
