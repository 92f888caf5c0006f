"""Hand-eye calibration as a procedure: take views of a chessboard, read them back, solve."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Literal, Protocol, runtime_checkable

import numpy as np

from collection.calibration.calibration import (
    BoardSection,
    CameraIntrinsics,
    HandEyeCalibration,
    Row,
    ViewResiduals,
)
from collection.calibration.chessboard import Board, find_corners
from collection.calibration.hand_eye import HandEye, View, solve_fixed_board, solve_gripper_board
from collection.cameras.frame_files import read_frame, read_gripper_pose, write_frame
from collection.errors import CalibrationError
from reach.arrays import FloatArray
from reach.transforms import make_transform, rotation_about
from registration.frame import DepthFrame, Intrinsics

Method = Literal["gripper-board", "fixed-board"]


@runtime_checkable
class RawCamera(Protocol):
    """A camera that takes images before anyone knows where it stands."""

    def capture_raw(self) -> DepthFrame:
        """Take a new image; the world is the camera's own frame."""
        ...


@runtime_checkable
class ObservedArm(Protocol):
    """An arm whose pose is read in any mode, also while a person guides it."""

    def observe(self) -> FloatArray:
        """T_world_gripper (4, 4); needs no connect() and no running program."""
        ...


def flat_board(x: float, y: float, height: float, yaw: float) -> FloatArray:
    """T_world_board (4, 4) of a board that lies face up.

    Args:
        x: of the first inner corner [m].
        y: of the first inner corner [m].
        height: of the printed face [m].
        yaw: direction in which the columns count up, about the vertical [rad].
    """
    face_up = rotation_about((1, 0, 0), np.pi)  # the board's z points into it
    return make_transform(rotation_about((0, 0, 1), yaw) @ face_up, (x, y, height))


def take_views(
    camera: RawCamera,
    carrier: Callable[[], FloatArray],
    board: Board,
    folder: Path,
    *,
    count: int,
    ready: Callable[[str], None],
) -> None:
    """Take views, one at a time, each when the person says so; keep only those with the board.

    Args:
        camera: connected.
        carrier: reads T_world_carrier, the pose of what carries the board, shape (4, 4).
        board: what must be seen.
        folder: where the views are kept, numbered on from those that are there.
        count: how many.
        ready: shows a message and returns when the person is ready.

    Raises:
        CalibrationError: the camera gives no color image.
    """
    folder.mkdir(parents=True, exist_ok=True)
    message = "Bring the whole board into view"
    taken = 0
    while taken < count:
        ready(f"View {taken + 1} of {count}. {message}, let it rest")
        pose, frame = carrier(), camera.capture_raw()
        if find_corners(_color(frame, "the camera"), board) is None:
            message = "The board was not seen whole; try again"
            continue
        number = 1 + len(list(folder.glob("view-*.npz")))
        write_frame(folder / f"view-{number:03}.npz", frame, T_world_gripper=pose)
        taken, message = taken + 1, "Turn the board another way"


def read_views(folder: Path, board: Board) -> tuple[list[View], Intrinsics]:
    """Read the views that `take_views` kept, or that were put there by hand.

    Raises:
        CalibrationError: there are none, they are of different cameras, or in one the board is
            not seen.
    """
    views, cameras = [], set[Intrinsics]()
    for path in sorted(folder.glob("*.npz")):
        frame, _ = read_frame(path)
        corners = find_corners(_color(frame, path.name), board)
        if corners is None:
            raise CalibrationError(
                f"{path.name}: no board of {board.columns} x {board.rows} inner corners is seen"
            )
        cameras.add(frame.intrinsics)
        views.append(View(path.stem, corners, read_gripper_pose(path)))
    if not views:
        raise CalibrationError(f"no views (.npz) in {folder}: --station FILE takes some")
    if len(cameras) > 1:
        raise CalibrationError(f"the views in {folder} are of {len(cameras)} different cameras")
    return views, cameras.pop()


def calibrate_views(
    views: Sequence[View], board: Board, camera: Intrinsics, method: Method
) -> HandEyeCalibration:
    """Solve, and put the result into the form that is kept.

    Raises:
        CalibrationError: the views do not determine the camera's pose.
    """
    solve = solve_gripper_board if method == "gripper-board" else solve_fixed_board
    solution = solve(views, board, camera)
    rows: list[Row] = [(a, b, c, d) for a, b, c, d in solution.T_world_camera.tolist()]
    return HandEyeCalibration(
        method=method,
        T_world_camera=(rows[0], rows[1], rows[2], rows[3]),
        intrinsics=CameraIntrinsics(
            width=camera.width,
            height=camera.height,
            fx=camera.fx,
            fy=camera.fy,
            cx=camera.cx,
            cy=camera.cy,
        ),
        board=BoardSection(columns=board.columns, rows=board.rows, square=board.square),
        reprojection_rms=_rms(solution.reprojection),
        translation_rms=_rms(solution.translation),
        rotation_rms=_rms(solution.rotation),
        position_std=solution.position_std,
        rotation_std=solution.rotation_std,
        views=tuple(_residuals(views, solution)),
    )


def _residuals(views: Sequence[View], solution: HandEye) -> Iterator[ViewResiduals]:
    for number, view in enumerate(views):
        yield ViewResiduals(
            name=view.name,
            reprojection=float(solution.reprojection[number]),
            translation=float(solution.translation[number]),
            rotation=float(solution.rotation[number]),
        )


def _rms(values: FloatArray) -> float:
    return float(np.sqrt(np.mean(np.square(values))))


def _color(frame: DepthFrame, name: str) -> np.ndarray[tuple[int, ...], np.dtype[np.uint8]]:
    if frame.color is None:
        raise CalibrationError(f"{name} gives no color image, which the chessboard is found in")
    return frame.color
