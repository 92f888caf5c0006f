"""Hand-eye calibration on rendered chessboards whose truth is known."""

from __future__ import annotations

import json
from pathlib import Path

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray

from collection.calibration.calibration import read_calibration
from collection.calibration.chessboard import Board, board_pose, find_corners, project
from collection.calibration.hand_eye import View, solve_fixed_board, solve_gripper_board
from collection.calibration.procedure import calibrate_views, flat_board, read_views, take_views
from collection.cameras.frame_files import write_frame
from collection.cli.main import main
from collection.errors import CalibrationError
from reach.arrays import FloatArray
from reach.transforms import (
    apply,
    exp,
    inverse,
    make_transform,
    rotation_about,
    rotation_angle,
)
from registration.frame import DepthFrame, Intrinsics

CAMERA = Intrinsics(640, 480, 620.0, 618.0, 321.3, 238.2)
BOARD = Board(9, 6, 0.02)
T_WORLD_CAMERA = make_transform(
    rotation_about((1, 0, 0), np.pi) @ rotation_about((0, 1, 0), 0.4), (0.75, -0.12, 0.65)
)
T_GRIPPER_BOARD = make_transform(
    rotation_about((0, 1, 0), 0.3) @ rotation_about((1, 0, 0), 0.2), (0.01, -0.03, 0.2)
)
OVERSAMPLING = 3


def render(T_camera_board: FloatArray, camera: Intrinsics = CAMERA) -> NDArray[np.uint8]:
    """A chessboard with a white border before a gray background, with sensor noise."""
    texel = 24  # pixels of the texture to a square
    squares = np.full((BOARD.rows + 3, BOARD.columns + 3), 235, np.uint8)
    r, c = np.indices((BOARD.rows + 1, BOARD.columns + 1))
    squares[1:-1, 1:-1][(r + c) % 2 == 0] = 25
    texture = np.kron(squares, np.ones((texel, texel), np.uint8))
    side, shift = BOARD.square / texel, (0.5 / texel - 2) * BOARD.square
    T_board_texture = np.array([[side, 0, shift], [0, side, shift], [0, 0, 1]])
    K = np.array([[camera.fx, 0, camera.cx], [0, camera.fy, camera.cy], [0, 0, 1]])
    plane = T_camera_board[:3, [0, 1, 3]]
    s = OVERSAMPLING
    up = np.array([[s, 0, (s - 1) / 2], [0, s, (s - 1) / 2], [0, 0, 1]])
    size = (camera.width * s, camera.height * s)
    big = cv2.warpPerspective(texture, up @ K @ plane @ T_board_texture, size, borderValue=120)
    image = cv2.resize(big, (camera.width, camera.height), interpolation=cv2.INTER_AREA)
    noise = np.random.default_rng(5).normal(0, 2, image.shape)
    return np.clip(image + noise, 0, 255).astype(np.uint8)


def board_poses(count: int, seed: int = 0) -> list[FloatArray]:
    """T_camera_board of boards well in view, turned about all axes."""
    rng, poses = np.random.default_rng(seed), []
    center = np.array([0.08, 0.05, 0.0])
    for _ in range(count):
        turn = exp([*rng.uniform(-0.5, 0.5, 2), rng.uniform(-3, 3), 0, 0, 0])[:3, :3]
        place = np.array([*rng.uniform(-0.03, 0.03, 2), rng.uniform(0.34, 0.45)])
        poses.append(make_transform(turn, place - turn @ center))
    return poses


def carrier_of(T_camera_board: FloatArray) -> FloatArray:
    """T_world_gripper that shows the board so."""
    return T_WORLD_CAMERA @ T_camera_board @ inverse(T_GRIPPER_BOARD)


def view(T_camera_board: FloatArray, noise: float = 0.0, seed: int = 0) -> View:
    """A view whose corners are computed, not found."""
    corners = project(apply(T_camera_board, BOARD.corners_board()), CAMERA)
    corners = corners + np.random.default_rng(seed).normal(0, noise, corners.shape)
    return View(f"view-{seed}", corners, carrier_of(T_camera_board))


def off(T: FloatArray, truth: FloatArray) -> tuple[float, float]:
    delta = inverse(truth) @ T
    return float(np.linalg.norm(delta[:3, 3])), rotation_angle(delta[:3, :3])


def frame(T_camera_board: FloatArray, *, color: bool = True) -> DepthFrame:
    image = np.repeat(render(T_camera_board)[..., None], 3, axis=2) if color else None
    depth = np.full((CAMERA.height, CAMERA.width), 0.5, np.float32)
    return DepthFrame(depth, CAMERA, make_transform(), color=image, time_ns=1)


@pytest.fixture(scope="module")
def kept(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder of rendered views."""
    folder = tmp_path_factory.mktemp("views")
    for number, T in enumerate(board_poses(8)):
        write_frame(folder / f"view-{number:03}.npz", frame(T), T_world_gripper=carrier_of(T))
    return folder


def test_corners_are_found_to_a_fraction_of_a_pixel_in_the_boards_order() -> None:
    for T in board_poses(6, seed=1):
        found = find_corners(render(T), BOARD)
        assert found is not None
        truth = project(apply(T, BOARD.corners_board()), CAMERA)
        assert np.sqrt(np.mean((found - truth) ** 2)) < 0.1


@pytest.mark.parametrize("turn", [0.0, np.pi / 2, np.pi, -np.pi / 2])
def test_half_a_turn_of_the_board_is_told_apart(turn: float) -> None:
    center = np.array([0.08, 0.05, 0.0])
    rotation = rotation_about((0, 0, 1), turn)
    T = make_transform(rotation, np.array([0, 0, 0.4]) - rotation @ center)
    found = find_corners(render(T), BOARD)
    assert found is not None
    assert off(board_pose(found, BOARD, CAMERA), T)[1] < 0.02


def test_no_board_is_no_answer() -> None:
    assert find_corners(np.full((480, 640), 120, np.uint8), BOARD) is None


def test_gripper_board_recovers_both_poses_from_images(kept: Path) -> None:
    views, camera = read_views(kept, BOARD)
    assert camera == CAMERA and len(views) == 8
    solution = solve_gripper_board(views, BOARD, camera)
    assert off(solution.T_world_camera, T_WORLD_CAMERA)[0] < 0.3e-3
    assert off(solution.T_world_camera, T_WORLD_CAMERA)[1] < 0.5e-3
    assert off(solution.T_carrier_board, T_GRIPPER_BOARD)[0] < 0.3e-3
    assert solution.reprojection.max() < 0.15


def test_exact_corners_give_the_exact_pose() -> None:
    solution = solve_gripper_board([view(T) for T in board_poses(5)], BOARD, CAMERA)
    assert off(solution.T_world_camera, T_WORLD_CAMERA)[0] < 1e-8
    assert solution.translation.max() < 1e-7


def test_the_stated_deviation_is_the_one_that_repeats() -> None:
    errors, stated = [], []
    for run in range(30):
        views = [view(T, noise=0.1, seed=10 * run + n) for n, T in enumerate(board_poses(6))]
        solution = solve_gripper_board(views, BOARD, CAMERA)
        errors.append(off(solution.T_world_camera, T_WORLD_CAMERA)[0])
        stated.append(solution.position_std)
    assert np.sqrt(np.mean(np.square(errors))) == pytest.approx(np.mean(stated), rel=0.3)


def test_a_wrong_gripper_pose_shows_in_the_residuals() -> None:
    views = [view(T) for T in board_poses(6)]
    moved = views[2].T_world_carrier @ make_transform(None, (0.01, 0, 0))
    views[2] = View("moved", views[2].corners, moved)
    solution = solve_gripper_board(views, BOARD, CAMERA)
    assert int(np.argmax(solution.translation)) == 2
    assert solution.translation[2] > 0.004


def test_a_fixed_board_needs_one_view() -> None:
    T_world_board = flat_board(0.3, -0.2, 0.002, 0.5)
    assert T_world_board[:3, 2] == pytest.approx([0, 0, -1])
    T_camera_board = board_poses(1)[0]
    corners = view(T_camera_board).corners
    solution = solve_fixed_board([View("only", corners, T_world_board)], BOARD, CAMERA)
    truth = T_world_board @ inverse(T_camera_board)
    assert off(solution.T_world_camera, truth)[0] < 1e-8


def test_turning_about_one_axis_is_refused() -> None:
    base = board_poses(1)[0]
    poses = [
        base @ make_transform(rotation_about((0, 0, 1), angle)) for angle in (0, 0.3, 0.6, 0.9, 1.2)
    ]
    with pytest.raises(CalibrationError, match="one axis"):
        solve_gripper_board([view(T) for T in poses], BOARD, CAMERA)


def test_too_few_views_are_refused() -> None:
    with pytest.raises(CalibrationError, match="3 views"):
        solve_gripper_board([view(T) for T in board_poses(3)], BOARD, CAMERA)
    with pytest.raises(CalibrationError, match="no view"):
        solve_fixed_board([], BOARD, CAMERA)


@pytest.mark.parametrize(("columns", "rows"), [(8, 6), (9, 7), (2, 5)])
def test_an_ambiguous_board_is_refused(columns: int, rows: int) -> None:
    with pytest.raises(CalibrationError, match="half a turn"):
        Board(columns, rows, 0.02)


def test_views_are_taken_until_the_board_was_seen_often_enough(tmp_path: Path) -> None:
    poses = board_poses(2, seed=4)
    blind = make_transform(None, (5.0, 0, 0.4))  # beside the image
    shown = [poses[0], blind, poses[1]]
    messages: list[str] = []

    class Camera:
        def capture_raw(self) -> DepthFrame:
            return frame(shown[len(messages) - 1])

    def carrier() -> FloatArray:
        return carrier_of(shown[len(messages) - 1])

    take_views(Camera(), carrier, BOARD, tmp_path, count=2, ready=messages.append)
    assert [path.name for path in sorted(tmp_path.iterdir())] == ["view-001.npz", "view-002.npz"]
    assert "not seen whole" in messages[2]
    views, _ = read_views(tmp_path, BOARD)
    assert np.allclose(views[1].T_world_carrier, carrier_of(poses[1]))


def test_a_camera_without_color_is_refused(tmp_path: Path) -> None:
    class Camera:
        def capture_raw(self) -> DepthFrame:
            return frame(board_poses(1)[0], color=False)

    with pytest.raises(CalibrationError, match="no color image"):
        take_views(Camera(), make_transform, BOARD, tmp_path, count=1, ready=lambda _: None)


def test_the_command_writes_a_file_with_residuals_and_hash(
    kept: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "calibration.json"
    arguments = ["calibrate", "--views-in", str(kept), "--square", "0.02", "--out", str(out)]
    assert main([*arguments, "--json"]) == 0
    printed = json.loads(capsys.readouterr().out)
    written = read_calibration(out)
    assert written.method == "gripper-board" and len(written.views) == 8
    assert printed["reprojection_rms"] == written.reprojection_rms < 0.15
    assert off(np.array(written.T_world_camera), T_WORLD_CAMERA)[0] < 0.3e-3
    assert written.sha256 == written.content_hash()
    assert main(arguments) == 0
    assert "8 views" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("arguments", "complaint"),
    [
        (["--board", "nine"], "--board 'nine'"),
        (["--board", "8x6"], "half a turn"),
        (["--board", "7x4"], "no board of 7 x 4"),
        (["--views-in", "/nowhere"], "no views"),
        (["--square", "0"], "square"),
    ],
)
def test_bad_input_is_one_line(
    kept: Path,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    arguments: list[str],
    complaint: str,
) -> None:
    base = ["calibrate", "--views-in", str(kept), "--out", str(tmp_path / "c.json")]
    assert main([*base, *arguments]) == 2
    error = capsys.readouterr().err
    assert error.startswith("error: ") and error.count("\n") == 1 and complaint in error


def test_views_of_two_cameras_are_refused(tmp_path: Path) -> None:
    T = board_poses(1)[0]
    first = frame(T)
    write_frame(tmp_path / "a.npz", first, T_world_gripper=carrier_of(T))
    other = Intrinsics(640, 480, 621.0, 618.0, 321.3, 238.2)
    write_frame(
        tmp_path / "b.npz",
        DepthFrame(first.depth, other, first.T_world_camera, color=first.color),
        T_world_gripper=carrier_of(T),
    )
    with pytest.raises(CalibrationError, match="2 different cameras"):
        read_views(tmp_path, BOARD)


def test_calibrated_views_state_their_method() -> None:
    views = [view(T, seed=n) for n, T in enumerate(board_poses(5))]
    result = calibrate_views(views, BOARD, CAMERA, "gripper-board")
    assert result.board.columns == 9 and result.intrinsics.fx == CAMERA.fx
    assert [each.name for each in result.views] == [each.name for each in views]
