"""A camera that is a folder: age, half-written files, formats, calibration."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from collection.calibration.calibration import (
    BoardSection,
    CameraIntrinsics,
    CameraPose,
    HandEyeCalibration,
)
from collection.cameras.folder import FolderCamera, FolderCameraConfig, build
from collection.cameras.frame_files import FrameFileError, read_frame, write_frame
from collection.clock import NANOSECONDS, SimulatedClock
from collection.errors import (
    CalibrationError,
    CameraNotConnectedError,
    CameraTimeoutError,
    Recovery,
)
from collection.station.drivers import BuildContext
from reach.errors import InvalidInputError
from reach.transforms import make_transform, rotation_about
from registration.frame import DepthFrame, Intrinsics

CAMERA = Intrinsics(8, 6, 10.0, 11.0, 3.5, 2.5)
POSE = make_transform(rotation_about((1, 0, 0), np.pi), (0.4, -0.1, 0.7))


def frame(value: float = 0.5, time_ns: int = 0) -> DepthFrame:
    rows = np.arange(48, dtype=np.float32).reshape(6, 8)
    depth = value + 0.001 * rows
    depth[0, 0] = np.nan
    color = np.arange(144, dtype=np.uint8).reshape(6, 8, 3)
    return DepthFrame(depth, CAMERA, make_transform(), color=color, time_ns=time_ns)


def write_calibration(path: Path, camera: Intrinsics = CAMERA) -> HandEyeCalibration:
    calibration = HandEyeCalibration(
        method="fixed-board",
        T_world_camera=tuple(map(tuple, POSE)),
        intrinsics=CameraIntrinsics(
            **{n: getattr(camera, n) for n in ("width", "height", "fx", "fy", "cx", "cy")}
        ),
        board=BoardSection(columns=9, rows=6, square=0.02),
        reprojection_rms=0.1,
        translation_rms=0.0001,
        rotation_rms=0.001,
        position_std=0.0001,
        rotation_std=0.0002,
        views=(),
    )
    calibration.write(path)
    return calibration


class Drop:
    """Files appear while the camera waits: at given simulated times."""

    def __init__(self, clock: SimulatedClock) -> None:
        self._clock, self._pending = clock, list[tuple[int, Callable[[], Path]]]()
        clock.follow(self._pass)

    def after(self, seconds: float, make: Callable[[], Path]) -> None:
        self._pending.append((self._clock.now_ns() + round(seconds * NANOSECONDS), make))

    def _pass(self, seconds: float) -> None:
        due = [(at, make) for at, make in self._pending if at <= self._clock.now_ns()]
        self._pending = [(at, m) for at, m in self._pending if at > self._clock.now_ns()]
        for at, make in due:
            stamp(make(), at)


def stamp(path: Path, time_ns: int) -> Path:
    os.utime(path, ns=(time_ns, time_ns))
    return path


@pytest.fixture
def clock() -> SimulatedClock:
    return SimulatedClock()


@pytest.fixture
def drop(clock: SimulatedClock) -> Drop:
    return Drop(clock)


@pytest.fixture
def camera(tmp_path: Path, clock: SimulatedClock) -> FolderCamera:
    (tmp_path / "frames").mkdir()
    write_calibration(tmp_path / "calibration.json")
    return make(tmp_path, clock)


def make(tmp_path: Path, clock: SimulatedClock, **settings: object) -> FolderCamera:
    values = {"folder": "frames", "calibration": "calibration.json", "timeout": 5.0, **settings}
    config = FolderCameraConfig.model_validate({"driver": "folder", **values})
    camera = build(config, BuildContext(None, clock, 0, tmp_path))
    camera.connect()
    return camera


def written(folder: Path, name: str, value: float = 0.5, time_ns: int = 0) -> Path:
    path = folder / "frames" / name
    write_frame(path, frame(value, time_ns))
    values = dict(np.load(path))
    if not time_ns:
        del values["time_ns"]
        np.savez(path, **values)
    return path


def test_a_new_frame_is_returned_with_the_calibrated_pose(
    camera: FolderCamera, drop: Drop, tmp_path: Path, clock: SimulatedClock
) -> None:
    drop.after(1.0, lambda: written(tmp_path, "new.npz"))
    captured = camera.capture()
    assert np.array_equal(captured.depth, frame().depth, equal_nan=True)
    assert np.array_equal(captured.T_world_camera, POSE)
    assert np.array_equal(captured.color, frame().color)
    assert captured.intrinsics == CAMERA


def test_a_frame_from_before_the_request_is_never_returned(
    camera: FolderCamera, tmp_path: Path, clock: SimulatedClock
) -> None:
    stamp(written(tmp_path, "old.npz"), clock.now_ns() - 12 * NANOSECONDS)
    with pytest.raises(CameraTimeoutError, match=r"old\.npz, is 12\.0 s older") as caught:
        camera.capture()
    assert caught.value.recovery is Recovery.RETRY


def test_an_old_frame_that_was_copied_in_late_is_not_returned(
    camera: FolderCamera, drop: Drop, tmp_path: Path, clock: SimulatedClock
) -> None:
    taken = clock.now_ns() - 60 * NANOSECONDS
    drop.after(1.0, lambda: written(tmp_path, "copied.npz", time_ns=taken))
    with pytest.raises(CameraTimeoutError, match=r"copied\.npz was taken 60\.0 s before"):
        camera.capture()


def test_of_two_new_frames_the_newest_is_returned(
    tmp_path: Path, clock: SimulatedClock, camera: FolderCamera, drop: Drop
) -> None:
    slow = make(tmp_path, clock, poll_interval=1.0)
    drop.after(0.5, lambda: written(tmp_path, "b.npz", 0.5))
    drop.after(1.0, lambda: written(tmp_path, "a.npz", 0.6))
    assert slow.capture().depth[0, 1] == np.float32(0.601)


def test_a_file_that_still_grows_is_waited_for(
    camera: FolderCamera, drop: Drop, tmp_path: Path
) -> None:
    whole = written(tmp_path, "whole.npz")
    content, path = whole.read_bytes(), tmp_path / "frames" / "growing.npz"
    whole.unlink()

    def part(share: float) -> Callable[[], Path]:
        def write() -> Path:
            path.write_bytes(content[: int(share * len(content))])
            return path

        return write

    for step in range(1, 11):
        drop.after(0.3 * step, part(step / 10))
    assert camera.capture().depth[0, 1] == np.float32(0.501)


def test_a_file_that_stays_half_written_is_named(
    camera: FolderCamera, drop: Drop, tmp_path: Path
) -> None:
    def half() -> Path:
        path = written(tmp_path, "half.npz")
        path.write_bytes(path.read_bytes()[:400])
        return path

    drop.after(1.0, half)
    with pytest.raises(CameraTimeoutError, match=r"unreadable: half\.npz is not a whole"):
        camera.capture()


@pytest.mark.parametrize("name", [".hidden.npz", "frame.npz.part", "notes.txt"])
def test_other_files_are_ignored(
    camera: FolderCamera, drop: Drop, tmp_path: Path, name: str
) -> None:
    def other() -> Path:
        path = written(tmp_path, "x.npz")
        path.rename(tmp_path / "frames" / name)
        return tmp_path / "frames" / name

    drop.after(1.0, other)
    with pytest.raises(CameraTimeoutError, match="no file matches"):
        camera.capture()


def test_a_frame_may_bring_its_own_pose(tmp_path: Path, clock: SimulatedClock, drop: Drop) -> None:
    (tmp_path / "frames").mkdir()
    camera = make(tmp_path, clock, calibration="")

    def posed() -> Path:
        path = tmp_path / "frames" / "posed.npz"
        write_frame(path, frame(time_ns=clock.now_ns()), T_world_camera=POSE)
        return path

    drop.after(1.0, posed)
    assert np.array_equal(camera.capture().T_world_camera, POSE)
    assert camera.intrinsics is None


def test_without_any_pose_a_capture_is_refused(
    tmp_path: Path, clock: SimulatedClock, drop: Drop
) -> None:
    (tmp_path / "frames").mkdir()
    camera = make(tmp_path, clock, calibration="")
    drop.after(1.0, lambda: written(tmp_path, "new.npz"))
    with pytest.raises(CalibrationError, match="reach calibrate"):
        camera.capture()


def test_a_raw_capture_needs_no_calibration(
    tmp_path: Path, clock: SimulatedClock, drop: Drop
) -> None:
    (tmp_path / "frames").mkdir()
    camera = make(tmp_path, clock, calibration="missing.json")
    drop.after(1.0, lambda: written(tmp_path, "new.npz"))
    assert np.array_equal(camera.capture_raw().T_world_camera, np.eye(4))


def test_a_calibration_of_another_camera_is_refused(
    camera: FolderCamera, drop: Drop, tmp_path: Path
) -> None:
    write_calibration(tmp_path / "calibration.json", Intrinsics(8, 6, 10.2, 11, 3.5, 2.5))
    drop.after(1.0, lambda: written(tmp_path, "new.npz"))
    with pytest.raises(CalibrationError, match="calibrate again"):
        camera.capture()


@pytest.mark.parametrize(("unit", "scale", "missing"), [("m", 1.0, np.nan), ("mm", 1000.0, 0.0)])
def test_organized_clouds_are_read_in_their_unit(
    tmp_path: Path,
    clock: SimulatedClock,
    drop: Drop,
    unit: str,
    scale: float,
    missing: float,
) -> None:
    (tmp_path / "frames").mkdir()
    write_calibration(tmp_path / "calibration.json")
    camera = make(tmp_path, clock, pattern="*.ply", unit=unit)
    drop.after(1.0, lambda: write_ply(tmp_path / "frames" / "a.ply", scale, missing))
    captured = camera.capture()
    assert np.allclose(captured.depth, frame().depth, equal_nan=True, atol=1e-5)
    assert np.isnan(captured.depth[0, 0])
    assert np.array_equal(captured.color, frame().color)


def test_a_cloud_that_is_not_organized_is_refused(tmp_path: Path) -> None:
    path = write_ply(tmp_path / "a.ply", 1.0, 0.0, points=40)
    with pytest.raises(FrameFileError, match="40 points, an image of 8 x 6 has 48"):
        read_frame(path, intrinsics=CAMERA)


def write_ply(path: Path, scale: float, missing: float, points: int = 48) -> Path:
    cloud = frame().points_camera().reshape(-1, 3) * scale
    cloud[np.isnan(cloud[:, 2])] = missing
    colors = frame().color
    assert colors is not None
    head = ["ply", "format ascii 1.0", f"element vertex {points}"]
    head += [f"property float {axis}" for axis in "xyz"]
    head += [f"property uchar {c}" for c in ("red", "green", "blue")] + ["end_header"]
    body = [
        " ".join([*(f"{x:.7g}" for x in p), *map(str, c)])
        for p, c in zip(cloud[:points], colors.reshape(-1, 3)[:points], strict=True)
    ]
    path.write_text("\n".join([*head, *body]) + "\n")
    return path


def test_frames_survive_being_written_and_read(tmp_path: Path) -> None:
    original = frame(time_ns=123)
    write_frame(tmp_path / "a.npz", original, T_world_gripper=POSE)
    back, T_world_camera = read_frame(tmp_path / "a.npz")
    assert np.array_equal(back.depth, original.depth, equal_nan=True)
    assert back.intrinsics == CAMERA and back.time_ns == 123 and T_world_camera is None
    assert not list(tmp_path.glob("*.part"))
    with pytest.raises(InvalidInputError, match="no weather"):
        write_frame(tmp_path / "a.npz", original, weather=1)


@pytest.mark.parametrize(
    ("change", "complaint"),
    [
        ({"intrinsics": None}, "has no intrinsics"),
        ({"intrinsics": np.ones(3)}, "expected fx, fy, cx, cy"),
        ({"intrinsics": np.array([-1.0, 1, 1, 1])}, "fx"),
        ({"depth": np.ones(5)}, r"expected \(H, W\)"),
        ({"color": np.ones((2, 2, 3), np.uint8)}, "color image"),
        ({"T_world_camera": np.ones((4, 4))}, "T_world_camera"),
        ({"scene": np.ones(2)}, "holds scene; valid"),
    ],
)
def test_a_wrong_npz_is_refused_with_the_reason(
    tmp_path: Path, change: dict[str, object], complaint: str
) -> None:
    values: dict[str, object] = {"depth": np.ones((6, 8)), "intrinsics": np.array([9.0, 9, 4, 3])}
    values |= change
    np.savez(tmp_path / "a.npz", **{k: v for k, v in values.items() if v is not None})
    with pytest.raises(FrameFileError, match=complaint):
        read_frame(tmp_path / "a.npz")


def test_a_missing_folder_is_said(tmp_path: Path, clock: SimulatedClock) -> None:
    config = FolderCameraConfig(driver="folder", folder="nowhere")
    camera = build(config, BuildContext(None, clock, 0, tmp_path))
    assert not camera.state().connected
    with pytest.raises(CameraNotConnectedError, match="nowhere does not exist"):
        camera.connect()
    with pytest.raises(CameraNotConnectedError, match="connect"):
        camera.capture()


def test_the_state_tells_the_age_of_the_newest_frame(
    camera: FolderCamera, tmp_path: Path, clock: SimulatedClock
) -> None:
    assert "yet" in camera.state().detail
    stamp(written(tmp_path, "a.npz"), clock.now_ns() - 30 * NANOSECONDS)
    assert camera.state().detail == "1 frames, the newest 30 s old"


def test_an_edited_calibration_is_noticed(tmp_path: Path) -> None:
    path = tmp_path / "calibration.json"
    write_calibration(path)
    path.write_text(path.read_text().replace('"reprojection_rms": 0.1', '"reprojection_rms": 0.01'))
    with pytest.raises(CalibrationError, match="edited"):
        _ = CameraPose(path).calibration
    path.write_text("{}")
    with pytest.raises(CalibrationError, match="method"):
        _ = CameraPose(path).calibration
    assert CameraPose(path).intrinsics is None
