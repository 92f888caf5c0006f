"""An Intel RealSense camera, or a recording of one, through the extra `[realsense]`."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, Self

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, PositiveFloat

from collection.calibration.calibration import CameraPose
from collection.cameras.protocol import CameraState
from collection.clock import Clock
from collection.errors import (
    CameraNotConnectedError,
    CameraTimeoutError,
    MissingExtraError,
)
from reach.transforms import make_transform
from registration.frame import DepthFrame, Intrinsics

if TYPE_CHECKING:
    from collection.station.drivers import BuildContext

FRAMES_IN_FLIGHT = 2
"""Pairs that may have been exposed before a request although they arrive after it."""


class RealSenseConfig(BaseModel):
    """The camera's section of a station file when the driver is `realsense`.

    Attributes:
        driver: `realsense`.
        serial: of the camera; empty for the only one connected.
        width: of the depth image [pixel].
        height: of the depth image [pixel].
        frame_rate: [1/s].
        calibration: file of `reach calibrate`.
        timeout: how long a capture waits for an image [s].
        recording: a .bag file that is played back in place of a camera.
    """

    model_config = ConfigDict(extra="forbid", frozen=True)

    driver: Literal["realsense"]
    serial: str = ""
    width: int = Field(1280, ge=16, le=4096)
    height: int = Field(720, ge=16, le=4096)
    frame_rate: int = Field(15, ge=1, le=90)
    calibration: str
    timeout: PositiveFloat = 5.0
    recording: str = ""


class RealSenseCamera:
    """Depth with registered color; one capture is one new image.

    A playback gives its images one after the other, each once; at its end a capture times out.

    Args:
        config: the camera's section of the station file.
        pose: where the camera stands.
        clock: of the station, for the time of a frame.
        recording: path of the .bag file, or None for a camera.
    """

    def __init__(
        self, config: RealSenseConfig, pose: CameraPose, clock: Clock, recording: Path | None
    ) -> None:
        self._config, self._pose, self._clock = config, pose, clock
        self._recording = recording
        self._pipeline: Any = None
        self._align: Any = None
        self._depth_unit = 0.0

    @property
    def name(self) -> str:
        """Of the camera, for logs."""
        if self._recording is not None:
            return f"RealSense recording {self._recording}"
        return f"RealSense {self._config.serial}".rstrip()

    @property
    def intrinsics(self) -> Intrinsics | None:
        """Of the calibration; None while there is none."""
        return self._pose.intrinsics

    @property
    def pose(self) -> CameraPose:
        """Where the camera stands."""
        return self._pose

    def connect(self) -> None:
        """Start streaming.

        Raises:
            MissingExtraError: pyrealsense2 is not installed.
            CameraNotConnectedError: no such camera, or no such recording.
        """
        if self._pipeline is not None:
            return
        rs = _library()
        pipeline, streams = rs.pipeline(), rs.config()
        if self._recording is not None:
            if not self._recording.is_file():
                raise CameraNotConnectedError(f"there is no recording {self._recording}")
            streams.enable_device_from_file(str(self._recording), repeat_playback=False)
        else:
            self._enable_streams(rs, streams)
        try:
            profile = pipeline.start(streams)
        except RuntimeError as error:
            raise CameraNotConnectedError(f"{self.name} does not start: {error}") from error
        if self._recording is not None:
            profile.get_device().as_playback().set_real_time(False)
        self._depth_unit = profile.get_device().first_depth_sensor().get_depth_scale()
        self._pipeline, self._align = pipeline, rs.align(rs.stream.depth)

    def disconnect(self) -> None:
        """Stop streaming; allowed at any time, more than once."""
        pipeline, self._pipeline = self._pipeline, None
        if pipeline is not None:
            pipeline.stop()

    def __enter__(self) -> Self:
        self.connect()
        return self

    def __exit__(self, *exception: object) -> None:
        self.disconnect()

    def state(self) -> CameraState:
        """Whether the camera streams; for one that does not, whether it could."""
        if self._pipeline is not None:
            return CameraState(True, self.name)
        try:
            rs = _library()
        except MissingExtraError as error:
            return CameraState(False, str(error))
        if self._recording is not None:
            found = self._recording.is_file()
            return CameraState(found, self.name if found else f"no recording {self._recording}")
        serials = [d.get_info(rs.camera_info.serial_number) for d in rs.context().query_devices()]
        wanted = self._config.serial
        found = wanted in serials if wanted else bool(serials)
        return CameraState(found, f"cameras found: {', '.join(serials) or 'none'}")

    def capture(self) -> DepthFrame:
        """Take a new image: nothing captured before this call is ever returned.

        Raises:
            CameraTimeoutError: no image arrived in time.
            CalibrationError: there is no calibration, or it is another camera's.
        """
        frame = self.capture_raw()
        return replace(frame, T_world_camera=self._pose.for_frame(frame.intrinsics))

    def capture_raw(self) -> DepthFrame:
        """Like `capture`, without calibration: the world is the camera's own frame."""
        if self._pipeline is None:
            raise CameraNotConnectedError(f"{self.name} is not connected: call connect() first")
        if self._recording is None:
            self._discard_old()
        frames = self._align.process(self._next())
        depth, color = frames.get_depth_frame(), frames.get_color_frame()
        meters = np.asarray(depth.get_data(), dtype=np.float32) * self._depth_unit
        meters[meters <= 0] = np.nan
        return DepthFrame(
            depth=meters,
            intrinsics=_intrinsics(depth),
            T_world_camera=make_transform(),
            color=np.asarray(color.get_data()) if color else None,
            time_ns=self._clock.now_ns(),
            sensor="stereo",
        )

    def _enable_streams(self, rs: Any, streams: Any) -> None:
        config = self._config
        if config.serial:
            streams.enable_device(config.serial)
        size = (config.width, config.height)
        streams.enable_stream(rs.stream.depth, *size, rs.format.z16, config.frame_rate)
        streams.enable_stream(rs.stream.color, *size, rs.format.rgb8, config.frame_rate)

    def _discard_old(self) -> None:
        """Drop what waits in the queue, and what was being exposed when the request came."""
        while self._pipeline.poll_for_frames():
            pass
        for _ in range(FRAMES_IN_FLIGHT):
            self._next()

    def _next(self) -> Any:
        try:
            return self._pipeline.wait_for_frames(round(1000 * self._config.timeout))
        except RuntimeError as error:
            raise CameraTimeoutError(
                f"{self.name}: no image within {self._config.timeout:.1f} s ({error})"
            ) from error


def build(config: RealSenseConfig, context: BuildContext) -> RealSenseCamera:
    """The camera of a station; inert until it is connected."""
    pose = CameraPose.from_setting(config.calibration, context.folder)
    recording = context.folder / config.recording if config.recording else None
    return RealSenseCamera(config, pose, context.clock, recording)


def _library() -> Any:
    try:
        import pyrealsense2
    except ImportError as error:
        raise MissingExtraError("the RealSense driver", "realsense") from error
    return pyrealsense2


def _intrinsics(depth: Any) -> Intrinsics:
    values = depth.profile.as_video_stream_profile().intrinsics
    return Intrinsics(values.width, values.height, values.fx, values.fy, values.ppx, values.ppy)
