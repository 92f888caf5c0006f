"""The RealSense driver against a stand-in for Intel's library.

The stand-in has the calls the driver makes and nothing of a camera's behavior: these tests show
units, ages, recordings and errors; what only a camera can show is listed in docs/hardware.md.
"""

from __future__ import annotations

import sys
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from collection.cameras.realsense import FRAMES_IN_FLIGHT, RealSenseConfig, build
from collection.clock import SimulatedClock
from collection.errors import (
    CalibrationError,
    CameraNotConnectedError,
    CameraTimeoutError,
    MissingExtraError,
    Recovery,
)
from collection.station.drivers import BuildContext


class Frames:
    """One pair of images; every pixel's raw depth is the pair's number."""

    def __init__(self, number: int) -> None:
        self.number = number

    def get_depth_frame(self) -> SimpleNamespace:
        raw = np.full((4, 6), self.number, np.uint16)
        raw[0, 0] = 0
        lens = SimpleNamespace(width=6, height=4, fx=5.0, fy=5.5, ppx=2.5, ppy=1.5)
        stream = SimpleNamespace(intrinsics=lens)
        profile = SimpleNamespace(as_video_stream_profile=lambda: stream)
        return SimpleNamespace(get_data=lambda: raw, profile=profile)

    def get_color_frame(self) -> SimpleNamespace:
        return SimpleNamespace(get_data=lambda: np.full((4, 6, 3), 7, np.uint8))


class Library:
    """What the driver calls of pyrealsense2."""

    def __init__(self) -> None:
        self.serials, self.waiting, self.left, self.number = ["123"], 5, 1000, 100
        self.real_time: bool | None = None
        self.started, self.file = False, ""
        self.stream = SimpleNamespace(depth="depth", color="color")
        self.format = SimpleNamespace(z16="z16", rgb8="rgb8")
        self.camera_info = SimpleNamespace(serial_number="serial")

    def config(self) -> SimpleNamespace:
        def from_file(name: str, repeat_playback: bool) -> None:
            assert not repeat_playback
            self.file = name

        return SimpleNamespace(
            enable_device=lambda serial: setattr(self, "wanted", serial),
            enable_stream=lambda *_: None,
            enable_device_from_file=from_file,
        )

    def pipeline(self) -> SimpleNamespace:
        return SimpleNamespace(
            start=self._start,
            stop=lambda: setattr(self, "started", False),
            poll_for_frames=self._poll,
            wait_for_frames=self._wait,
        )

    def align(self, stream: str) -> SimpleNamespace:
        assert stream == "depth"
        return SimpleNamespace(process=lambda frames: frames)

    def context(self) -> SimpleNamespace:
        devices = [SimpleNamespace(get_info=lambda _, s=serial: s) for serial in self.serials]
        return SimpleNamespace(query_devices=lambda: devices)

    def _start(self, _: object) -> SimpleNamespace:
        if not self.serials and not self.file:
            raise RuntimeError("No device connected")
        self.started = True
        playback = SimpleNamespace(set_real_time=lambda on: setattr(self, "real_time", on))
        sensor = SimpleNamespace(get_depth_scale=lambda: 0.001)
        device = SimpleNamespace(as_playback=lambda: playback, first_depth_sensor=lambda: sensor)
        return SimpleNamespace(get_device=lambda: device)

    def _poll(self) -> Frames | None:
        if self.waiting == 0:
            return None
        self.waiting -= 1
        return self._wait(0)

    def _wait(self, _: int) -> Frames:
        if self.left == 0:
            raise RuntimeError("Frame didn't arrive within 5000")
        self.left -= 1
        self.number += 1
        return Frames(self.number)


@pytest.fixture
def library(monkeypatch: pytest.MonkeyPatch) -> Library:
    library = Library()
    monkeypatch.setitem(sys.modules, "pyrealsense2", library)
    return library


def camera(tmp_path: Path, **settings: object):  # type: ignore[no-untyped-def]
    values = {"driver": "realsense", "calibration": "calibration.json", **settings}
    config = RealSenseConfig.model_validate(values)
    return build(config, BuildContext(None, SimulatedClock(), 0, tmp_path))


def test_without_the_extra_the_error_names_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "pyrealsense2", None)
    with pytest.raises(MissingExtraError, match=r"reach-trials\[realsense\]"):
        camera(tmp_path).connect()
    assert "realsense" in camera(tmp_path).state().detail


def test_depth_is_in_meters_and_holes_are_nan(tmp_path: Path, library: Library) -> None:
    with camera(tmp_path) as device:
        frame = device.capture_raw()
    assert frame.depth[1, 1] == pytest.approx(library.number / 1000)
    assert np.isnan(frame.depth[0, 0])
    assert (frame.intrinsics.fy, frame.intrinsics.cx) == (5.5, 2.5)
    assert frame.sensor == "stereo" and frame.color is not None
    assert not library.started


def test_images_from_before_the_request_are_dropped(tmp_path: Path, library: Library) -> None:
    with camera(tmp_path) as device:
        frame = device.capture_raw()
    # five waited in the queue, and two more may have been exposed before the request
    assert frame.depth[1, 1] == pytest.approx((100 + 5 + FRAMES_IN_FLIGHT + 1) / 1000)


def test_a_capture_needs_a_calibration(tmp_path: Path, library: Library) -> None:
    with camera(tmp_path) as device, pytest.raises(CalibrationError, match="reach calibrate"):
        device.capture()


def test_a_camera_that_sends_nothing_times_out(tmp_path: Path, library: Library) -> None:
    library.waiting = library.left = 0
    with camera(tmp_path) as device, pytest.raises(CameraTimeoutError) as caught:
        device.capture_raw()
    assert caught.value.recovery is Recovery.RETRY


def test_a_recording_gives_each_image_once_and_then_ends(tmp_path: Path, library: Library) -> None:
    (tmp_path / "take.bag").write_bytes(b"")
    library.left = 2
    with camera(tmp_path, recording="take.bag") as device:
        assert library.file.endswith("take.bag") and library.real_time is False
        numbers = [round(1000 * float(device.capture_raw().depth[1, 1])) for _ in range(2)]
        assert numbers == [101, 102]
        with pytest.raises(CameraTimeoutError):
            device.capture_raw()


def test_what_is_not_there_is_said(tmp_path: Path, library: Library) -> None:
    with pytest.raises(CameraNotConnectedError, match=r"gone\.bag"):
        camera(tmp_path, recording="gone.bag").connect()
    assert not camera(tmp_path, recording="gone.bag").state().connected
    assert not camera(tmp_path, serial="999").state().connected
    assert "123" in camera(tmp_path, serial="999").state().detail
    library.serials = []
    with pytest.raises(CameraNotConnectedError, match="No device"):
        camera(tmp_path).connect()
    with pytest.raises(CameraNotConnectedError, match="connect"):
        camera(tmp_path).capture()
