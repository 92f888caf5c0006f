"""A chessboard in an image: its corners, and its pose before the camera."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from collection.errors import CalibrationError
from reach.arrays import FloatArray, positive
from reach.transforms import make_transform, rotation_about
from registration.frame import Intrinsics


@dataclass(frozen=True, slots=True)
class Board:
    """A chessboard. Its frame: origin in the first inner corner, x along, y across, z into it.

    The first inner square (between corners 0 and 1 along and across) is dark. One of the two
    numbers of corners must be odd and the other even: otherwise the board looks the same after
    half a turn.

    Args:
        columns: inner corners along.
        rows: inner corners across.
        square: side of a square [m].

    Raises:
        CalibrationError: a number below 3, or both odd or both even.
    """

    columns: int
    rows: int
    square: float

    def __post_init__(self) -> None:
        positive(self.square, "side of a square [m]")
        if min(self.columns, self.rows) < 3 or self.columns % 2 == self.rows % 2:
            raise CalibrationError(
                f"a board of {self.columns} x {self.rows} inner corners cannot be told from itself"
                " turned by half a turn; take one odd and one even number, at least 3"
            )

    def corners_board(self) -> FloatArray:
        """Corners row by row, shape (rows * columns, 3) [m]."""
        x, y = np.meshgrid(np.arange(self.columns), np.arange(self.rows))
        points = np.stack([x.ravel(), y.ravel(), np.zeros(x.size)], axis=1)
        return np.asarray(points * self.square, dtype=float)


def find_corners(image: NDArray[np.uint8], board: Board) -> FloatArray | None:
    """Corners of the board in an image, in the board's order, to a fraction of a pixel.

    Args:
        image: RGB (H, W, 3) or gray (H, W).
        board: what to look for.

    Returns:
        Shape (rows * columns, 2) [pixel], or None if the whole board is not seen.
    """
    import cv2

    gray: Any = cv2.cvtColor(image, cv2.COLOR_RGB2GRAY) if image.ndim == 3 else image
    flags = cv2.CALIB_CB_NORMALIZE_IMAGE | cv2.CALIB_CB_EXHAUSTIVE | cv2.CALIB_CB_ACCURACY
    found, corners = cv2.findChessboardCornersSB(gray, (board.columns, board.rows), flags=flags)
    if not found:
        return None
    ordered = np.asarray(corners, dtype=float).reshape(board.rows, board.columns, 2)
    if _is_mirrored(ordered):
        ordered = ordered[::-1]
    if not _first_square_is_dark(gray, ordered):
        ordered = ordered[::-1, ::-1]
    return np.ascontiguousarray(ordered.reshape(-1, 2))


def board_pose(corners: FloatArray, board: Board, camera: Intrinsics) -> FloatArray:
    """T_camera_board (4, 4) from the corners (N, 2) of one image.

    Raises:
        CalibrationError: the corners fit no pose.
    """
    import cv2

    K = np.array([[camera.fx, 0, camera.cx], [0, camera.fy, camera.cy], [0, 0, 1]])
    points = board.corners_board()
    found, rotation, translation = cv2.solvePnP(points, corners, K, None, flags=cv2.SOLVEPNP_IPPE)
    if found:
        rotation, translation = cv2.solvePnPRefineLM(
            points, corners, K, None, rotation, translation
        )
    vector = np.ravel(rotation)
    angle = float(np.linalg.norm(vector))
    if not found or not np.isfinite(angle):
        raise CalibrationError("the corners of the chessboard fit no pose")
    turn = rotation_about(vector, angle) if angle > 0 else np.eye(3)
    return make_transform(turn, np.ravel(translation))


def project(points_camera: FloatArray, camera: Intrinsics) -> FloatArray:
    """Pixels (..., 2) of points (..., 3) [m] before the camera."""
    x, y, z = np.moveaxis(points_camera, -1, 0)
    return np.stack([camera.fx * x / z + camera.cx, camera.fy * y / z + camera.cy], axis=-1)


def _is_mirrored(corners: FloatArray) -> bool:
    """Whether rows run against the sense in which a board is seen from its front."""
    along, across = corners[0, -1] - corners[0, 0], corners[-1, 0] - corners[0, 0]
    return bool(along[0] * across[1] - along[1] * across[0] < 0)


def _first_square_is_dark(gray: NDArray[np.uint8], corners: FloatArray) -> bool:
    def brightness(column: int) -> float:
        center = corners[0:2, column : column + 2].reshape(-1, 2).mean(axis=0)
        u, v = np.round(center).astype(int)
        return float(np.mean(gray[v - 1 : v + 2, u - 1 : u + 2]))

    return brightness(0) < brightness(1)
