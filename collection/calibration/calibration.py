"""The hand-eye calibration of a fixed camera, as `reach calibrate` writes it and cameras read it."""

from __future__ import annotations

import hashlib
import json
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Literal, Protocol, Self, runtime_checkable

from pydantic import BaseModel, ConfigDict, Field, ValidationError, model_validator

from collection.errors import CalibrationError

if TYPE_CHECKING:
    from reach.arrays import FloatArray
    from registration.frame import Intrinsics

Row = tuple[float, float, float, float]
SAME_FOCAL_LENGTH = 0.005
"""A camera whose focal length differs by a larger share is another, or set up otherwise."""


class _Section(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True)


class CameraIntrinsics(_Section):
    """The pinhole camera that was calibrated [pixel]."""

    width: int = Field(gt=0)
    height: int = Field(gt=0)
    fx: float = Field(gt=0)
    fy: float = Field(gt=0)
    cx: float
    cy: float


class BoardSection(_Section):
    """The chessboard: inner corners along and across, and the side of a square [m]."""

    columns: int = Field(ge=3)
    rows: int = Field(ge=3)
    square: float = Field(gt=0)


class ViewResiduals(_Section):
    """How far one view is from the solution.

    Attributes:
        name: of the view.
        reprojection: root mean square over the corners [pixel].
        translation: between the board as seen and as the robot holds it [m].
        rotation: the same [rad].
    """

    name: str
    reprojection: float = Field(ge=0)
    translation: float = Field(ge=0)
    rotation: float = Field(ge=0)


class HandEyeCalibration(_Section):
    """Where a fixed camera stands, how that was found, and how well it fits.

    Attributes:
        format: of this file.
        method: `gripper-board`: the gripper showed the board in many poses; `fixed-board`: the
            board lay at a known pose.
        T_world_camera: camera frame x right, y down, z ahead; four rows.
        intrinsics: of the camera at the time.
        board: the chessboard.
        reprojection_rms: over all corners of all views [pixel].
        translation_rms: of the views' translation residuals [m].
        rotation_rms: of their rotation residuals [rad].
        position_std: standard deviation of the camera's position, from the fit [m].
        rotation_std: of its rotation, from the fit [rad].
        views: residuals of every view.
        sha256: of all of the above.
    """

    format: Literal["reach-hand-eye-1"] = "reach-hand-eye-1"
    method: Literal["gripper-board", "fixed-board"]
    T_world_camera: tuple[Row, Row, Row, Row]
    intrinsics: CameraIntrinsics
    board: BoardSection
    reprojection_rms: float = Field(ge=0)
    translation_rms: float = Field(ge=0)
    rotation_rms: float = Field(ge=0)
    position_std: float = Field(ge=0)
    rotation_std: float = Field(ge=0)
    views: tuple[ViewResiduals, ...]
    sha256: str = ""

    @model_validator(mode="after")
    def _is_unchanged(self) -> Self:
        if self.sha256 and self.sha256 != self.content_hash():
            raise ValueError("the content does not match its sha256: the file was edited")
        return self

    def content_hash(self) -> str:
        """Hash of everything but the hash."""
        content = self.model_dump(mode="json", exclude={"sha256"})
        return hashlib.sha256(json.dumps(content, sort_keys=True).encode()).hexdigest()

    def write(self, path: Path) -> None:
        """Write the file, in one piece."""
        sealed = self.model_copy(update={"sha256": self.content_hash()})
        beside = path.with_name(path.name + ".part")
        beside.write_text(sealed.model_dump_json(indent=2) + "\n", encoding="utf-8")
        beside.replace(path)


def read_calibration(path: Path) -> HandEyeCalibration:
    """Read a calibration file.

    Raises:
        CalibrationError: there is none, or it is not one, or it was edited.
    """
    try:
        text = path.read_text(encoding="utf-8")
    except OSError as error:
        raise CalibrationError(
            f"no calibration at {path}; `reach calibrate` makes one ({error.strerror})"
        ) from error
    try:
        return HandEyeCalibration.model_validate_json(text)
    except ValidationError as error:
        first = error.errors()[0]
        place = ".".join(str(part) for part in first["loc"]) or "the file"
        raise CalibrationError(f"{path}: {place}: {first['msg']}") from error


@dataclass(frozen=True)
class CameraPose:
    """Where a station's camera stands, read from its calibration file when first needed.

    Args:
        path: of the calibration file; None if the camera's frames bring their own pose.
    """

    path: Path | None

    @classmethod
    def from_setting(cls, setting: str, folder: Path) -> CameraPose:
        """From a station file's `calibration`, relative to its folder; empty for none."""
        return cls(folder / setting if setting else None)

    @cached_property
    def calibration(self) -> HandEyeCalibration | None:
        """The calibration; None if the camera's frames bring their own pose.

        Raises:
            CalibrationError: the file is missing or no calibration.
        """
        return None if self.path is None else read_calibration(self.path)

    @property
    def intrinsics(self) -> Intrinsics | None:
        """Of the calibrated camera; None without (a readable) calibration."""
        from registration.frame import Intrinsics

        try:
            calibration = self.calibration
        except CalibrationError:
            return None
        if calibration is None:
            return None
        return Intrinsics(**calibration.intrinsics.model_dump())

    def for_frame(self, intrinsics: Intrinsics) -> FloatArray:
        """T_world_camera (4, 4) for a frame with these intrinsics.

        Raises:
            CalibrationError: there is no calibration, or it is another camera's.
        """
        from reach.transforms import as_transform

        calibration = self.calibration
        if calibration is None:
            raise CalibrationError(
                "the frame does not say where the camera stands (T_world_camera), and the station"
                " file names no calibration: run `reach calibrate`"
            )
        known = calibration.intrinsics
        same_size = (known.width, known.height) == (intrinsics.width, intrinsics.height)
        if not same_size or abs(known.fx / intrinsics.fx - 1) > SAME_FOCAL_LENGTH:
            raise CalibrationError(
                f"the calibration {self.path} is of a {known.width} x {known.height} camera with"
                f" fx {known.fx:.1f}, the frame of a {intrinsics.width} x {intrinsics.height} one"
                f" with fx {intrinsics.fx:.1f}: calibrate again"
            )
        return as_transform(calibration.T_world_camera, "T_world_camera")


@runtime_checkable
class CalibratedCamera(Protocol):
    """A camera whose pose comes from a calibration file."""

    @property
    def pose(self) -> CameraPose:
        """Where the camera stands."""
        ...


def calibration_of(camera: object) -> HandEyeCalibration | None:
    """The calibration of a station's camera, with its residuals, to be kept with a session.

    Returns:
        None for a camera that has no calibration file (a simulated one, or frames that bring
        their own pose).

    Raises:
        CalibrationError: the file that the station names is missing or no calibration.
    """
    return camera.pose.calibration if isinstance(camera, CalibratedCamera) else None
