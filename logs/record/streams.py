"""What a trial measures over time: images, joints, jaw, moving frames."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from reach.arrays import FloatArray, IntArray, frozen
from reach.errors import InvalidInputError
from reach.transforms import as_transform

WORLD = "world"
"""Name of the world frame."""
JPEG_QUALITY = 90


@dataclass(frozen=True, slots=True, eq=False)
class CameraRecord:
    """A pinhole camera without distortion, and where it stands.

    Args:
        name: names the camera's topics and frame: `depth`, `color`.
        width: of the image [pixel].
        height: of the image [pixel].
        fx: focal length along x [pixel].
        fy: focal length along y [pixel].
        cx: principal point, x [pixel]; pixel centers are at integer coordinates.
        cy: principal point, y [pixel].
        T_world_camera: x right, y down, z ahead, shape (4, 4).
        sensor: kind of sensor, such as `stereo`.
    """

    name: str
    width: int
    height: int
    fx: float
    fy: float
    cx: float
    cy: float
    T_world_camera: FloatArray
    sensor: str = ""

    def __post_init__(self) -> None:
        object.__setattr__(
            self, "T_world_camera", as_transform(self.T_world_camera, "T_world_camera")
        )


@dataclass(frozen=True, slots=True, eq=False)
class DepthImage:
    """One depth image.

    Args:
        time_ns: of capture [ns].
        depth: distance along the optical axis [m], NaN where there is no return, float32; or
            uint16 in millimeters, 0 where there is no return. Shape (H, W).
        camera: name of the camera.
    """

    time_ns: int
    depth: NDArray[np.float32] | NDArray[np.uint16]
    camera: str = "depth"

    def __post_init__(self) -> None:
        dtype = np.uint16 if np.asarray(self.depth).dtype == np.uint16 else np.float32
        depth = frozen(self.depth, dtype)
        if depth.ndim != 2:
            raise InvalidInputError(f"depth image has shape {depth.shape}, expected (H, W)")
        object.__setattr__(self, "depth", depth)

    def meters(self) -> NDArray[np.float32]:
        """Depth [m], NaN where there is no return, shape (H, W), float32."""
        if self.depth.dtype == np.float32:
            return self.depth.astype(np.float32, copy=False)
        return np.where(self.depth == 0, np.float32(np.nan), self.depth * np.float32(1e-3))


@dataclass(frozen=True, slots=True)
class ColorImage:
    """One color frame, compressed on its own.

    Args:
        time_ns: of capture [ns].
        data: a JPEG or PNG file.
        format: `jpeg` or `png`.
        camera: name of the camera.
    """

    time_ns: int
    data: bytes
    format: str = "jpeg"
    camera: str = "color"

    @classmethod
    def compress(cls, time_ns: int, pixels: NDArray[np.uint8], camera: str) -> ColorImage:
        """Compress RGB pixels, shape (H, W, 3), as JPEG."""
        import io

        from PIL import Image

        buffer = io.BytesIO()
        Image.fromarray(pixels).save(buffer, "jpeg", quality=JPEG_QUALITY)
        return cls(time_ns, buffer.getvalue(), "jpeg", camera)

    def pixels(self) -> NDArray[np.uint8]:
        """Decode to RGB, shape (H, W, 3)."""
        import io

        from PIL import Image

        return np.asarray(Image.open(io.BytesIO(self.data)).convert("RGB"))


@dataclass(frozen=True, slots=True, eq=False)
class CloudRecord:
    """An unorganized cloud, of a camera that gives no image.

    Args:
        time_ns: of capture [ns].
        points_camera: shape (N, 3), float32 [m].
        camera: name of the camera.
    """

    time_ns: int
    points_camera: NDArray[np.float32]
    camera: str = "depth"

    def __post_init__(self) -> None:
        points = frozen(self.points_camera, np.float32)
        if points.ndim != 2 or points.shape[1] != 3:
            raise InvalidInputError(f"cloud has shape {points.shape}, expected (N, 3)")
        object.__setattr__(self, "points_camera", points)


@dataclass(frozen=True, slots=True, eq=False)
class JointTrack:
    """The robot's joints over time.

    Args:
        time_ns: of capture, shape (N,).
        names: of the J joints.
        positions: [rad] or [m], shape (N, J).
        velocities: [rad/s] or [m/s], shape (N, J), NaN where unknown.
        efforts: [Nm] or [N], shape (N, J), NaN where unknown.
    """

    time_ns: IntArray
    names: tuple[str, ...]
    positions: FloatArray
    velocities: FloatArray
    efforts: FloatArray


@dataclass(frozen=True, slots=True, eq=False)
class JawTrack:
    """The gripper's jaws over time.

    Args:
        time_ns: of capture, shape (N,).
        widths: distance between the pads [m], shape (N,).
        forces: closing force of a jaw [N], NaN where unknown, shape (N,).
    """

    time_ns: IntArray
    widths: FloatArray
    forces: FloatArray


@dataclass(frozen=True, slots=True, eq=False)
class FrameTrack:
    """One frame over time.

    Args:
        parent: name of the parent frame.
        child: name of the frame.
        time_ns: of capture, shape (N,).
        translations: of the child in the parent [m], shape (N, 3).
        quaternions_xyzw: rotation of the child in the parent, shape (N, 4).
    """

    parent: str
    child: str
    time_ns: IntArray
    translations: FloatArray
    quaternions_xyzw: FloatArray

    def transforms(self) -> FloatArray:
        """T_parent_child over time, shape (N, 4, 4)."""
        x, y, z, w = self.quaternions_xyzw.T
        result = np.zeros((len(self.time_ns), 4, 4))
        result[:, 0, :3] = np.stack(
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)], -1
        )
        result[:, 1, :3] = np.stack(
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)], -1
        )
        result[:, 2, :3] = np.stack(
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)], -1
        )
        result[:, :3, 3] = self.translations
        result[:, 3, 3] = 1.0
        return result
