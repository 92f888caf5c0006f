"""A camera that is a folder: any vendor's tool drops frames into it.

This is how a camera joins whose own software takes the picture (PhoXi, Zivid, Ensenso, ...), and
it is the double of a camera in tests. A frame is one file, see
[collection.cameras.frame_files][].
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Literal, Self

from pydantic import BaseModel, ConfigDict, Field, PositiveFloat

from collection.calibration.calibration import CameraPose
from collection.cameras.frame_files import FrameFileError, read_frame
from collection.cameras.protocol import CameraState
from collection.clock import NANOSECONDS, Clock
from collection.errors import CameraNotConnectedError, CameraTimeoutError

if TYPE_CHECKING:
    from collection.station.drivers import BuildContext
    from reach.arrays import FloatArray
    from registration.frame import DepthFrame, Intrinsics

UNFINISHED = (".tmp", ".part", ".partial", ".crdownload")


class FolderCameraConfig(BaseModel):
    """The camera's section of a station file when the driver is `folder`.

    Attributes:
        driver: `folder`.
        folder: where frames appear; relative to the station file.
        pattern: of the frames' file names.
        unit: of the points of .ply frames; .npz frames are in meters.
        sensor: kind of sensor; sets registration's noise scales.
        calibration: file of `reach calibrate`; empty if every frame brings its T_world_camera.
        timeout: how long a capture waits for a new frame [s].
        poll_interval: between two looks into the folder [s].
    """

    model_config = ConfigDict(extra="forbid", frozen=True)

    driver: Literal["folder"]
    folder: str
    pattern: str = "*.npz"
    unit: Literal["m", "mm"] = "m"
    sensor: Literal["structured-light", "stereo"] = "structured-light"
    calibration: str = ""
    timeout: PositiveFloat = 30.0
    poll_interval: PositiveFloat = Field(0.1, le=10)


@dataclass(frozen=True, slots=True)
class _Seen:
    """A file at one look: it is whole when it is the same at the next."""

    path: Path
    size: int
    modified_ns: int


class FolderCamera:
    """Waits for a frame that is newer than the request for it.

    Args:
        config: the camera's section of the station file.
        folder: where frames appear.
        pose: where the camera stands.
        clock: of the station; files must be stamped by the same clock.
    """

    def __init__(
        self, config: FolderCameraConfig, folder: Path, pose: CameraPose, clock: Clock
    ) -> None:
        self._config, self._folder, self._pose, self._clock = config, folder, pose, clock
        self._connected = False

    @property
    def name(self) -> str:
        """Of the camera, for logs."""
        return f"folder {self._folder}"

    @property
    def intrinsics(self) -> Intrinsics | None:
        """Of the calibration, if there is one; otherwise only a frame can tell."""
        return self._pose.intrinsics

    @property
    def pose(self) -> CameraPose:
        """Where the camera stands."""
        return self._pose

    def connect(self) -> None:
        """Check that the folder is there.

        Raises:
            CameraNotConnectedError: it is not.
        """
        if not self._folder.is_dir():
            raise CameraNotConnectedError(f"the camera's folder {self._folder} does not exist")
        self._connected = True

    def disconnect(self) -> None:
        """Forget the folder; allowed at any time, more than once."""
        self._connected = False

    def __enter__(self) -> Self:
        self.connect()
        return self

    def __exit__(self, *exception: object) -> None:
        self.disconnect()

    def state(self) -> CameraState:
        """Whether the folder is there, and how old its newest frame is."""
        if not self._folder.is_dir():
            return CameraState(False, f"the folder {self._folder} does not exist")
        seen = list(self._look())
        if not seen:
            return CameraState(True, f"no {self._config.pattern} in {self._folder} yet")
        age = (self._clock.now_ns() - max(file.modified_ns for file in seen)) / NANOSECONDS
        return CameraState(True, f"{len(seen)} frames, the newest {age:.0f} s old")

    def capture(self) -> DepthFrame:
        """Wait for a new frame: nothing taken before this call is ever returned.

        Raises:
            CameraTimeoutError: none came in time; says what was there instead.
            CalibrationError: neither a calibration nor the frame says where the camera stands.
        """
        frame, T_world_camera = self._wait()
        if T_world_camera is None:
            T_world_camera = self._pose.for_frame(frame.intrinsics)
        return replace(frame, T_world_camera=T_world_camera)

    def capture_raw(self) -> DepthFrame:
        """Like `capture`, without calibration: the world is the camera's own frame."""
        return self._wait()[0]

    def _wait(self) -> tuple[DepthFrame, FloatArray | None]:
        if not self._connected:
            raise CameraNotConnectedError(f"{self.name} is not connected: call connect() first")
        asked_ns = self._clock.now_ns()
        deadline = asked_ns + round(self._config.timeout * NANOSECONDS)
        before: set[_Seen] = set()
        unreadable: dict[Path, str] = {}
        while True:
            now = set(self._look())
            whole = [file for file in now & before if file.modified_ns >= asked_ns]
            for file in sorted(whole, key=lambda each: (-each.modified_ns, each.path.name)):
                try:
                    return read_frame(
                        file.path,
                        not_before_ns=asked_ns,
                        sensor=self._config.sensor,
                        unit=self._config.unit,
                        intrinsics=self._pose.intrinsics,
                        modified_ns=file.modified_ns,
                    )
                except FrameFileError as error:
                    unreadable[file.path] = str(error)
            if self._clock.now_ns() >= deadline:
                raise CameraTimeoutError(self._complaint(now, asked_ns, unreadable))
            before = now
            self._clock.sleep(self._config.poll_interval)

    def _look(self) -> Iterator[_Seen]:
        for path in self._folder.glob(self._config.pattern):
            if path.name.startswith(".") or path.suffix in UNFINISHED:
                continue
            try:
                stat = path.stat()
            except FileNotFoundError:  # moved away between the listing and the look
                continue
            yield _Seen(path, stat.st_size, stat.st_mtime_ns)

    def _complaint(self, seen: set[_Seen], asked_ns: int, unreadable: dict[Path, str]) -> str:
        waited = f"no new frame in {self._folder} within {self._config.timeout:.0f} s"
        if unreadable:
            return f"{waited}; unreadable: {'; '.join(unreadable.values())}"
        if not seen:
            return f"{waited}: no file matches {self._config.pattern}"
        newest = max(seen, key=lambda file: file.modified_ns)
        age = (asked_ns - newest.modified_ns) / NANOSECONDS
        return f"{waited}: the newest, {newest.path.name}, is {age:.1f} s older than the request"


def build(config: FolderCameraConfig, context: BuildContext) -> FolderCamera:
    """The camera of a station; inert until it is connected."""
    pose = CameraPose.from_setting(config.calibration, context.folder)
    return FolderCamera(config, context.folder / config.folder, pose, context.clock)
