"""Depth frames as files: organized .npz and .ply.

A .npz frame holds `depth` (H, W) [m], 0 or NaN where there is no return; `intrinsics`
(fx, fy, cx, cy) [pixel]; and may hold `color` (H, W, 3) uint8, `T_world_camera` (4, 4),
`time_ns`, and `T_world_gripper` (4, 4) when it was taken to calibrate. A .ply frame holds the
points (x, y, z) of every pixel, row by row, in the camera's frame (x right, y down, z ahead).
"""

from __future__ import annotations

import io
import zipfile
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from collection.errors import CameraError
from reach.arrays import FloatArray
from reach.errors import InvalidInputError
from reach.transforms import as_transform, make_transform
from registration.frame import DepthFrame, Intrinsics

if TYPE_CHECKING:
    from numpy.typing import NDArray

UNITS = {"m": 1.0, "mm": 1e-3}
_NPZ_KEYS = {"depth", "intrinsics", "color", "T_world_camera", "time_ns", "T_world_gripper"}


class FrameFileError(CameraError):
    """A file that is not (yet) a depth frame, or one from before the request."""


def read_frame(
    path: Path,
    *,
    not_before_ns: int = 0,
    sensor: str = "structured-light",
    unit: str = "m",
    intrinsics: Intrinsics | None = None,
    modified_ns: int | None = None,
) -> tuple[DepthFrame, FloatArray | None]:
    """Read one frame.

    Args:
        path: a .npz or .ply file.
        not_before_ns: refuse a frame that says it was taken earlier [ns].
        sensor: kind of sensor.
        unit: of a .ply file's points, `m` or `mm`.
        intrinsics: of the camera; a .ply file has none of its own.
        modified_ns: time of a frame that does not say when it was taken [ns].

    Returns:
        The frame, with the camera's own frame as world, and the T_world_camera that the file
        brings, or None.

    Raises:
        FrameFileError: half-written, of another shape, or older than `not_before_ns`.
    """
    if path.suffix == ".npz":
        values = _read_npz(path)
    elif path.suffix == ".ply":
        values = _read_ply(path, unit, intrinsics)
    else:
        raise FrameFileError(f"{path.name}: a frame is a .npz or .ply file")
    time_ns = int(values.get("time_ns", modified_ns or 0))
    if time_ns < not_before_ns:
        early = (not_before_ns - time_ns) / 1e9
        raise FrameFileError(f"{path.name} was taken {early:.1f} s before the request")
    try:
        T = values.get("T_world_camera")
        frame = DepthFrame(
            depth=values["depth"],
            intrinsics=values["intrinsics"],
            T_world_camera=make_transform(),
            color=values.get("color"),
            time_ns=time_ns,
            sensor=sensor,
        )
        return frame, None if T is None else as_transform(T, "T_world_camera")
    except InvalidInputError as error:
        raise FrameFileError(f"{path.name}: {error}") from error


def read_gripper_pose(path: Path) -> FloatArray:
    """T_world_gripper (4, 4) of a .npz frame that was taken to calibrate.

    Raises:
        FrameFileError: the frame was taken for something else.
    """
    T = _read_npz(path).get("T_world_gripper")
    if T is None:
        raise FrameFileError(f"{path.name} has no T_world_gripper: where was the board?")
    try:
        return as_transform(T, "T_world_gripper")
    except InvalidInputError as error:
        raise FrameFileError(f"{path.name}: {error}") from error


def write_frame(path: Path, frame: DepthFrame, **extra: Any) -> None:
    """Write a .npz frame; `extra` may add T_world_camera, T_world_gripper.

    The file appears in one piece: it is written beside and then renamed.
    """
    camera = frame.intrinsics
    values: dict[str, Any] = {
        "depth": frame.depth,
        "intrinsics": np.array([camera.fx, camera.fy, camera.cx, camera.cy]),
        "time_ns": np.int64(frame.time_ns),
        **extra,
    }
    if frame.color is not None:
        values["color"] = frame.color
    unknown = set(values) - _NPZ_KEYS
    if unknown:
        raise InvalidInputError(f"a frame has no {', '.join(sorted(unknown))}")
    beside = path.with_suffix(".npz.part")
    with beside.open("wb") as file:
        np.savez_compressed(file, **values)
    beside.replace(path)


def _read_npz(path: Path) -> dict[str, Any]:
    try:
        # From memory: numpy leaves the file of a broken archive open.
        with np.load(io.BytesIO(path.read_bytes()), allow_pickle=False) as archive:
            values: dict[str, Any] = {name: archive[name] for name in archive.files}
    except (OSError, ValueError, EOFError, KeyError, zipfile.BadZipFile) as error:
        raise FrameFileError(f"{path.name} is not a whole .npz file: {error}") from error
    missing = {"depth", "intrinsics"} - set(values)
    if missing:
        raise FrameFileError(f"{path.name} has no {', '.join(sorted(missing))}")
    unknown = set(values) - _NPZ_KEYS
    if unknown:
        known = ", ".join(sorted(_NPZ_KEYS))
        raise FrameFileError(f"{path.name} holds {', '.join(sorted(unknown))}; valid: {known}")
    depth, four = values["depth"], np.ravel(values["intrinsics"])
    if depth.ndim != 2 or four.shape != (4,):
        raise FrameFileError(
            f"{path.name}: depth has shape {depth.shape}, expected (H, W); intrinsics has"
            f" {len(four)} numbers, expected fx, fy, cx, cy"
        )
    height, width = depth.shape
    try:
        values["intrinsics"] = Intrinsics(width, height, *(float(number) for number in four))
    except InvalidInputError as error:
        raise FrameFileError(f"{path.name}: {error}") from error
    values["depth"] = _without_zeros(depth)
    return values


def _read_ply(path: Path, unit: str, intrinsics: Intrinsics | None) -> dict[str, Any]:
    import open3d

    if intrinsics is None:
        raise FrameFileError(f"{path.name}: a .ply frame needs a calibration with intrinsics")
    quiet = open3d.utility.VerbosityContextManager(open3d.utility.VerbosityLevel.Error)
    with quiet:
        cloud = open3d.io.read_point_cloud(path, remove_nan_points=False)
    points = np.asarray(cloud.points) * UNITS[unit]
    shape = (intrinsics.height, intrinsics.width)
    if len(points) != shape[0] * shape[1]:
        raise FrameFileError(
            f"{path.name} holds {len(points)} points, an image of {intrinsics.width} x"
            f" {intrinsics.height} has {shape[0] * shape[1]}: half-written, or not organized"
        )
    values: dict[str, Any] = {
        "depth": _without_zeros(points[:, 2].reshape(shape)),
        "intrinsics": intrinsics,
    }
    if cloud.has_colors():
        colors = np.asarray(cloud.colors).reshape(*shape, 3)
        values["color"] = np.round(255 * np.nan_to_num(colors)).astype(np.uint8)
    return values


def _without_zeros(depth: NDArray[Any]) -> NDArray[np.float32]:
    """Depth with NaN where there is no return: vendors also write 0 or infinity."""
    depth = np.array(depth, dtype=np.float32)
    depth[~(np.isfinite(depth) & (depth > 0))] = np.nan
    return depth
