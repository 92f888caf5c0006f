"""An unorganized point cloud seen from its camera, as an organized depth image."""

from __future__ import annotations

import math

import numpy as np

from reach.arrays import BoolArray, FloatArray, IntArray
from reach.errors import InvalidInputError
from registration.frame import DepthFrame, Intrinsics

FILLED = 0.75
"""Share of the pixels around the cloud's points that must hold one; else the image is made
coarser."""
COARSEST = 16


def frame_from_cloud(
    points_camera: FloatArray,
    intrinsics: Intrinsics,
    T_world_camera: FloatArray,
    *,
    sensor: str = "structured-light",
) -> DepthFrame:
    """Project a cloud into the image of the camera that took it.

    The nearest point wins a pixel. A cloud that was thinned leaves holes, which registration
    would take for missing returns, so that the image's resolution is lowered until most pixels
    around a point are filled.

    Args:
        points_camera: shape (N, 3), camera frame (x right, y down, z ahead) [m]; points that are
            not finite are left out.
        intrinsics: of the camera.
        T_world_camera: its calibrated pose, shape (4, 4).
        sensor: kind of sensor, see `DepthFrame`.

    Raises:
        InvalidInputError: no point lies in the image.
    """
    points = np.asarray(points_camera, dtype=float).reshape(-1, 3)
    points = points[np.isfinite(points).all(axis=1)]
    if len(points) > 0 and not (points[:, 2] > 0).any():
        raise InvalidInputError(
            f"all {len(points)} points of the cloud lie behind the camera, whose frame is "
            "x right, y down, z ahead: check the cloud's frame"
        )
    points = points[points[:, 2] > 0]
    for shrink in range(1, COARSEST + 1):
        coarse = _coarser(intrinsics, shrink)
        u, v, inside = _project(points, coarse)
        if not inside.any():
            raise InvalidInputError(
                f"none of the cloud's {len(points)} points ahead of the camera lies in its "
                f"{intrinsics.width} x {intrinsics.height} image: check intrinsics and pose"
            )
        if shrink == COARSEST or _filled(u[inside], v[inside], coarse) >= FILLED:
            break
    depth = np.full((coarse.height, coarse.width), np.inf)
    np.minimum.at(depth, (v[inside], u[inside]), points[inside, 2])
    depth[np.isinf(depth)] = np.nan
    return DepthFrame(depth.astype(np.float32), coarse, T_world_camera, sensor=sensor)


def _coarser(k: Intrinsics, shrink: int) -> Intrinsics:
    """The same camera with pixels `shrink` times as wide; pixel centers stay at integers."""
    return Intrinsics(
        math.ceil(k.width / shrink),
        math.ceil(k.height / shrink),
        k.fx / shrink,
        k.fy / shrink,
        (k.cx + 0.5) / shrink - 0.5,
        (k.cy + 0.5) / shrink - 0.5,
    )


def _project(points: FloatArray, k: Intrinsics) -> tuple[IntArray, IntArray, BoolArray]:
    """Columns (N,), rows (N,) and which points lie in the image (N,)."""
    u = np.floor(points[:, 0] / points[:, 2] * k.fx + k.cx + 0.5).astype(np.int64)
    v = np.floor(points[:, 1] / points[:, 2] * k.fy + k.cy + 0.5).astype(np.int64)
    return u, v, (u >= 0) & (v >= 0) & (u < k.width) & (v < k.height)


def _filled(u: IntArray, v: IntArray, k: Intrinsics) -> float:
    """Share of the pixels beside a filled one that are filled themselves."""
    filled = np.zeros((k.height, k.width), bool)
    filled[v, u] = True
    beside = np.zeros_like(filled)
    beside[:, 1:-1] = filled[:, :-2] | filled[:, 2:]
    beside[1:-1] |= filled[:-2] | filled[2:]
    return float(filled[beside].mean()) if beside.any() else 0.0
