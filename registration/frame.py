"""An organized depth image with its camera: what a depth camera hands to registration."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from reach.arrays import FloatArray, frozen, positive
from reach.errors import InvalidInputError
from reach.transforms import as_transform

SENSOR_KINDS = ("structured-light", "stereo")


@dataclass(frozen=True, slots=True)
class Intrinsics:
    """A pinhole camera without distortion (images are rectified by the driver).

    Args:
        width: of the image [pixel].
        height: of the image [pixel].
        fx: focal length along x [pixel].
        fy: focal length along y [pixel].
        cx: principal point, x [pixel]; pixel centers are at integer coordinates.
        cy: principal point, y [pixel].
    """

    width: int
    height: int
    fx: float
    fy: float
    cx: float
    cy: float

    def __post_init__(self) -> None:
        for name in ("width", "height", "fx", "fy"):
            positive(getattr(self, name), f"intrinsics {name}")

    def rays(self) -> FloatArray:
        """Points (H, W, 3) at depth 1 m seen by each pixel, camera frame (x right, y down, z ahead)."""
        u, v = np.meshgrid(np.arange(self.width), np.arange(self.height))
        return np.stack(
            [(u - self.cx) / self.fx, (v - self.cy) / self.fy, np.ones_like(u, dtype=float)],
            axis=-1,
        )


@dataclass(frozen=True, slots=True, eq=False)
class DepthFrame:
    """One organized depth image.

    Args:
        depth: distance along the optical axis, NaN where there is no return, shape (H, W) [m].
        intrinsics: of the depth image.
        T_world_camera: calibrated pose of the camera (x right, y down, z ahead), shape (4, 4).
        color: registered RGB image, shape (H, W, 3), uint8, or None.
        time_ns: time of capture [ns].
        sensor: kind of sensor, one of SENSOR_KINDS: sets noise scales and thresholds.

    Raises:
        InvalidInputError: shapes differ, a depth is not positive, the sensor is unknown.
        InvalidTransformError: T_world_camera is not rigid.
    """

    depth: NDArray[np.float32]
    intrinsics: Intrinsics
    T_world_camera: FloatArray
    color: NDArray[np.uint8] | None = None
    time_ns: int = 0
    sensor: str = "structured-light"

    def __post_init__(self) -> None:
        set_field = object.__setattr__
        depth = frozen(self.depth, np.float32)
        shape = (self.intrinsics.height, self.intrinsics.width)
        if depth.shape != shape:
            raise InvalidInputError(f"depth image has shape {depth.shape}, intrinsics say {shape}")
        if np.any(depth <= 0) or np.any(np.isinf(depth)):
            raise InvalidInputError("depth image holds zero, negative or infinite depths; use NaN")
        if self.sensor not in SENSOR_KINDS:
            raise InvalidInputError(
                f"unknown sensor {self.sensor!r}; valid: {', '.join(SENSOR_KINDS)}"
            )
        set_field(self, "depth", depth)
        set_field(self, "T_world_camera", as_transform(self.T_world_camera, "T_world_camera"))
        if self.color is not None:
            color: Any = frozen(self.color, np.uint8)
            if color.shape != (*shape, 3):
                raise InvalidInputError(
                    f"color image has shape {color.shape}, expected {(*shape, 3)}"
                )
            set_field(self, "color", color)

    def points_camera(self) -> FloatArray:
        """Organized points (H, W, 3), camera frame [m]; NaN where there is no return."""
        points: FloatArray = self.intrinsics.rays() * self.depth[..., None].astype(float)
        return points
