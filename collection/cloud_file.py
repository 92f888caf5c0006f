"""Depth frames and point clouds from files, for the commands that read one."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Literal

from pydantic import BaseModel, ConfigDict, ValidationError

from registration.errors import CloudFileError

if TYPE_CHECKING:
    from reach.arrays import FloatArray
    from registration.frame import DepthFrame

CLOUD_SUFFIXES = (".ply", ".pcd")
SUFFIXES = (".npz", *CLOUD_SUFFIXES)


class IntrinsicsEntry(BaseModel):
    """A pinhole camera's numbers [pixel]."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    width: int
    height: int
    fx: float
    fy: float
    cx: float
    cy: float


class CameraFile(BaseModel):
    """What a cloud needs beside its points.

    `cloud_frame` says in which frame the points are given, `unit` in which unit.
    """

    model_config = ConfigDict(extra="forbid", frozen=True)

    T_world_camera: tuple[tuple[float, float, float, float], ...]
    intrinsics: IntrinsicsEntry | None = None
    cloud_frame: Literal["camera", "world"] = "camera"
    unit: Literal["m", "mm"] = "m"
    sensor: Literal["structured-light", "stereo"] | None = None


def read_camera_file(path: Path) -> CameraFile:
    """Read a camera file.

    Raises:
        CloudFileError: unreadable, or not what a camera file holds.
    """
    try:
        return CameraFile.model_validate_json(path.read_text(encoding="utf-8"))
    except (OSError, UnicodeDecodeError) as error:
        raise CloudFileError(f"cannot read camera file {str(path)!r}: {error}") from error
    except ValidationError as error:
        first = error.errors()[0]
        where = ".".join(map(str, first["loc"])) or "file"
        raise CloudFileError(f"camera file {path.name!r}: {where}: {first['msg']}") from error


def read_cloud(path: Path, camera: Path | None = None, sensor: str | None = None) -> DepthFrame:
    """Read a depth frame (.npz) or an unorganized cloud (.ply, .pcd) with its camera.

    Args:
        path: the frame or cloud.
        camera: camera file; a cloud needs it, and so does a frame without T_world_camera.
        sensor: kind of sensor; overrides the camera file.

    Raises:
        CloudFileError: unreadable file, or a camera is missing.
    """
    if path.suffix not in SUFFIXES:
        raise CloudFileError(f"cannot read {path.name!r}; valid: {', '.join(SUFFIXES)}")
    if not path.is_file():
        raise CloudFileError(f"no file at {str(path)!r}")
    view = None if camera is None else read_camera_file(camera)
    kind = sensor or (view.sensor if view is not None else None) or "structured-light"
    if path.suffix == ".npz":
        return _read_frame(path, view, kind)
    if view is None or view.intrinsics is None:
        raise CloudFileError(
            f"cloud {path.name!r} does not say how it was seen: give --camera with "
            "intrinsics and T_world_camera"
        )
    return _read_points(path, view, view.intrinsics, kind)


def _read_frame(path: Path, view: CameraFile | None, sensor: str) -> DepthFrame:
    from collection.cameras.frame_files import read_frame
    from reach.transforms import as_transform

    frame, own = read_frame(path, sensor=sensor)
    T = own if view is None else as_transform(view.T_world_camera, "T_world_camera")
    if T is None:
        raise CloudFileError(
            f"frame {path.name!r} holds no T_world_camera: give --camera with the camera's pose"
        )
    return replace(frame, T_world_camera=T)


def _read_points(path: Path, view: CameraFile, entry: IntrinsicsEntry, sensor: str) -> DepthFrame:
    from reach.transforms import apply, as_transform, inverse
    from registration.cloud import frame_from_cloud
    from registration.frame import Intrinsics

    T_world_camera = as_transform(view.T_world_camera, "T_world_camera")
    points = _points(path) * (1e-3 if view.unit == "mm" else 1.0)
    if view.cloud_frame == "world":
        points = apply(inverse(T_world_camera), points)
    intrinsics = Intrinsics(**entry.model_dump())
    return frame_from_cloud(points, intrinsics, T_world_camera, sensor=sensor)


def _points(path: Path) -> FloatArray:
    import numpy as np
    import open3d

    quiet = open3d.utility.VerbosityContextManager(open3d.utility.VerbosityLevel.Error)
    with quiet:
        cloud = open3d.io.read_point_cloud(path)
    points = np.asarray(cloud.points, dtype=float)
    if len(points) == 0:
        raise CloudFileError(f"cloud {path.name!r} holds no points, or is not a cloud")
    return points
