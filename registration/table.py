"""The table in the depth image: a plane, and the noise of the depths that lie on it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from reach.arrays import FloatArray
from registration.correlation import autocorrelation
from registration.errors import NoTableError
from registration.frame import DepthFrame

SAMPLED = 4000
"""Pixels the plane is fitted to, on a regular grid over the image."""
TRIALS = 150
"""Planes through three random pixels that are tried."""
SMALLEST_SHARE = 0.2
"""A table covers at least this share of the returns."""


@dataclass(frozen=True, slots=True, eq=False)
class Table:
    """A plane fitted to the table.

    Args:
        normal_camera: unit normal pointing up, shape (3,), camera frame.
        offset_camera: normal_camera @ p for points p on the table, camera frame [m].
        rms: of the table's points about the plane, outliers left out [m].
        noise: robust standard deviation of a single depth, along the normal [m].
        correlation: of the errors of neighboring pixels, see `registration.correlation`.
        T_world_camera: the calibrated pose of the camera, shape (4, 4).
    """

    normal_camera: FloatArray
    offset_camera: float
    rms: float
    noise: float
    correlation: FloatArray
    T_world_camera: FloatArray

    @property
    def correlation_area(self) -> float:
        """How many neighboring pixels share one error [pixel].

        n pixels say as much about their mean as n / correlation_area independent ones.
        """
        return max(1.0, float(self.correlation.sum()))

    @property
    def normal_world(self) -> FloatArray:
        """Unit normal pointing up, shape (3,), world frame."""
        result: FloatArray = self.T_world_camera[:3, :3] @ self.normal_camera
        return result

    @property
    def offset_world(self) -> float:
        """normal_world @ p for points p on the table, world frame [m]."""
        return float(self.offset_camera + self.normal_world @ self.T_world_camera[:3, 3])

    @property
    def tilt(self) -> float:
        """Angle between the table's normal and the world's z [rad]."""
        return float(np.arccos(np.clip(self.normal_world[2], -1.0, 1.0)))

    def slope(self, point_camera: FloatArray) -> float:
        """|normal . ray| for the ray of unit depth through a point (3,): the height of a depth."""
        return float(np.abs(self.normal_camera @ point_camera) / point_camera[2])

    def T_camera_table(self, near_camera: FloatArray) -> FloatArray:
        """Frame with z up from the table, origin on the table below a point (3,), x near world x."""
        up = self.normal_camera
        origin = near_camera - (up @ near_camera - self.offset_camera) * up
        x = self.T_world_camera[:3, :3].T @ np.array([1.0, 0.0, 0.0])
        x = x - (x @ up) * up
        x /= np.linalg.norm(x)
        T = np.eye(4)
        T[:3, :3] = np.column_stack([x, np.cross(up, x), up])
        T[:3, 3] = origin
        return T

    def heights(self, points_camera: FloatArray) -> FloatArray:
        """Heights (...) [m] above the table of points (..., 3), camera frame; NaN stays NaN."""
        n = self.normal_camera
        x, y, z = points_camera[..., 0], points_camera[..., 1], points_camera[..., 2]
        height: FloatArray = n[0] * x + n[1] * y + n[2] * z - self.offset_camera
        return height


def fit_table(
    frame: DepthFrame,
    rng: np.random.Generator,
    *,
    noise_bounds: tuple[float, float],
    max_tilt: float,
) -> Table:
    """Find the plane that most returns lie on, nearly level in the world.

    Args:
        frame: the depth image.
        rng: draws the pixels of the trial planes.
        noise_bounds: smallest and largest believable noise of a depth [m].
        max_tilt: largest angle between the plane's normal and the world's z [rad].

    Raises:
        NoTableError: no such plane holds SMALLEST_SHARE of the returns.
    """
    points = _grid_of_points(frame)
    if len(points) < 50:
        raise NoTableError(f"no table: the depth image has only {len(points)} returns on its grid")
    up = frame.T_world_camera[2, :3]
    band = 3 * noise_bounds[1]
    normal, offset = _best_plane(points, up, rng, band, max_tilt)
    inlier = np.abs(_dot(points, normal) - offset) < band
    share = float(inlier.mean())
    if share < SMALLEST_SHARE:
        raise NoTableError(
            f"no table: the most level plane holds {share:.0%} of the returns, "
            f"expected at least {SMALLEST_SHARE:.0%} within {np.degrees(max_tilt):.0f} deg of level"
        )
    for _ in range(6):
        normal, offset = _plane_through(points[inlier])
        residual = _dot(points, normal) - offset
        noise = 1.4826 * float(np.median(np.abs(residual[inlier])))
        noise = min(max(noise, noise_bounds[0]), noise_bounds[1])
        inlier = np.abs(residual) < 3 * noise
        if inlier.sum() < 30:
            raise NoTableError("no table: its plane does not settle")
    if normal @ up < 0:
        normal, offset = -normal, -offset
    if normal @ up < np.cos(max_tilt):
        raise NoTableError(
            f"the table is tilted by {np.degrees(np.arccos(normal @ up)):.0f} deg against the "
            f"world, more than {np.degrees(max_tilt):.0f} deg: the calibration is off"
        )
    rms = float(np.sqrt(np.mean(residual[inlier] ** 2)))
    correlation = _autocorrelation(frame, normal, offset, noise)
    return Table(normal, offset, rms, noise, correlation, frame.T_world_camera)


def _grid_of_points(frame: DepthFrame) -> FloatArray:
    """Points (N, 3), camera frame, on a regular grid over the image, N about SAMPLED."""
    height, width = frame.depth.shape
    step = max(1, int(np.sqrt(height * width / SAMPLED)))
    v, u = np.meshgrid(
        np.arange(step // 2, height, step), np.arange(step // 2, width, step), indexing="ij"
    )
    z = frame.depth[v, u].astype(float)
    k = frame.intrinsics
    points = np.stack([(u - k.cx) / k.fx * z, (v - k.cy) / k.fy * z, z], axis=-1).reshape(-1, 3)
    return np.asarray(points[np.isfinite(points[:, 2])])


def _best_plane(
    points: FloatArray, up: FloatArray, rng: np.random.Generator, band: float, max_tilt: float
) -> tuple[FloatArray, float]:
    corners = points[rng.integers(0, len(points), (TRIALS, 3))]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    length = np.linalg.norm(normals, axis=1)
    normals = normals / np.maximum(length, 1e-12)[:, None]
    normals *= np.sign(normals @ up + 1e-300)[:, None]
    level = (length > 1e-6) & (normals @ up > np.cos(1.5 * max_tilt))
    offsets = (normals * corners[:, 0]).sum(axis=1)
    best, best_count = 0, -1
    subset = points[:: max(1, len(points) // 1500)]
    for i in np.flatnonzero(level):
        count = int((np.abs(_dot(subset, normals[i]) - offsets[i]) < band).sum())
        if count > best_count:
            best, best_count = int(i), count
    if best_count < 0:
        raise NoTableError(
            "no table: no plane in the image is nearly level in the world; "
            "check that T_world_camera is the camera's pose and the world's z points up"
        )
    return normals[best], float(offsets[best])


def _plane_through(points: FloatArray) -> tuple[FloatArray, float]:
    """Least-squares plane of points (N, 3): unit normal (3,) and offset [m]."""
    center = points.mean(axis=0)
    away = points - center
    # Sums entry by entry: a matrix product's rounding may depend on the number of threads.
    moments = np.array([[(away[:, i] * away[:, j]).sum() for j in range(3)] for i in range(3)])
    normal = np.linalg.eigh(moments)[1][:, 0]
    return normal, float(normal @ center)


def _dot(points: FloatArray, v: FloatArray) -> FloatArray:
    result: FloatArray = points[:, 0] * v[0] + points[:, 1] * v[1] + points[:, 2] * v[2]
    return result


def _autocorrelation(
    frame: DepthFrame, normal: FloatArray, offset: float, noise: float
) -> FloatArray:
    """Correlation of the heights of neighboring pixels of the table."""
    height = plane_heights(frame, normal, offset)
    with np.errstate(invalid="ignore"):
        on_table = np.abs(height) < 3 * noise
    return autocorrelation(height, on_table)


def plane_heights(frame: DepthFrame, normal: FloatArray, offset: float) -> NDArray[np.float32]:
    """Height of every pixel above a plane, shape (H, W) [m]; NaN without a return."""
    k = frame.intrinsics
    across = (normal[0] * (np.arange(k.width) - k.cx) / k.fx).astype(np.float32)
    down = (normal[1] * (np.arange(k.height) - k.cy) / k.fy + normal[2]).astype(np.float32)
    height: NDArray[np.float32] = frame.depth * (across[None, :] + down[:, None])
    height -= np.float32(offset)
    return height
