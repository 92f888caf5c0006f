"""The last refinement: exact distances, the table's support, and an honest covariance.

The pose is the maximum a posteriori under two kinds of evidence: observed points lie on the
surface, and the part stands on the table. Neighboring depths share their errors, so N points
count as N divided by the correlation area measured on the table.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from reach.arrays import FloatArray
from reach.transforms import exp, inverse, rotation_log
from registration.mesh_model import MeshModel
from registration.observation import Observation
from registration.options import SensorProfile

POINTS = 1500
STEPS = 4
TILT_SLACK, HEIGHT_SLACK = np.radians(0.4), 2e-4
"""How far a part on a real table may be from its ideal stable pose: standard deviations [rad, m]."""
PRINT_ERROR = 3e-5
"""Standard deviation of the part's shape against its mesh, as an offset of the whole pose [m]."""
UNKNOWN_TURN, UNKNOWN_PLACE = np.radians(60), 0.1
"""Standard deviations of a direction that nothing tells about [rad, m]."""


@dataclass(frozen=True, slots=True, eq=False)
class Polished:
    """A refined pose.

    Args:
        T_camera_object: shape (4, 4).
        covariance: of (rotation, translation), right perturbation, object frame, shape (6, 6).
        information: what the points alone tell, before the table and priors, shape (6, 6).
        fitness: share of the candidate's points within three noise widths of the surface.
        rmse: of those points' distances [m].
    """

    T_camera_object: FloatArray
    covariance: FloatArray
    information: FloatArray
    fitness: float
    rmse: float


def polish(
    model: MeshModel,
    seen: Observation,
    T_camera_object: FloatArray,
    profile: SensorProfile,
    *,
    on_table: bool,
) -> Polished:
    """Refine one pose and tell how well it is known.

    Args:
        model: of the part.
        seen: the image's window.
        T_camera_object: start, shape (4, 4); with on_table it stands on the table.
        profile: of the sensor.
        on_table: hold height and tilt to those of the start, as a table would.
    """
    noise = seen.table.noise
    count = min(POINTS, len(seen.points))
    points = seen.points[np.arange(count) * len(seen.points) // count]
    scale = max(0.4e-3, 3 * noise)
    T = np.array(T_camera_object)
    support = _Support(T, seen.table.normal_camera, model.obj.com) if on_table else None
    for step in range(STEPS + 1):
        residual, jacobian = _residuals(model, points, T)
        weight = (scale**2 / (scale**2 + residual**2)) ** 2
        sigma = _spread(residual, weight, noise)
        effective = min(count, len(seen.points) / seen.table.correlation_area)
        gain = weight * (effective / count / sigma**2)
        information = _weighted_gram(jacobian, gain)
        gradient = (jacobian * (gain * residual)[:, None]).sum(axis=0)
        total = information + _vague()
        if support is not None:
            prior, pull = support.information(T)
            total, gradient = total + prior, gradient + pull
        if step == STEPS:
            break
        T = T @ exp(-np.linalg.solve(total, gradient))
    T[:3, :3] = _orthonormal(T[:3, :3])
    near = np.abs(residual) < max(3 * noise, 0.5e-3)
    covariance = np.linalg.inv(total) + _systematic(T, points, profile)
    return Polished(
        T,
        0.5 * (covariance + covariance.T),
        information,
        fitness=float(near.mean()),
        rmse=float(np.sqrt(np.mean(residual[near] ** 2))) if near.any() else float("inf"),
    )


class _Support:
    """The table's hold on height and tilt, about the pose that stands on it ideally."""

    def __init__(self, T_ideal: FloatArray, up_camera: FloatArray, com: FloatArray) -> None:
        x = np.cross(up_camera, (1.0, 0.0, 0.0) if abs(up_camera[0]) < 0.9 else (0.0, 1.0, 0.0))
        x /= np.linalg.norm(x)
        self._level = np.stack([x, np.cross(up_camera, x)])
        self._up, self._com = up_camera, com
        self._R = T_ideal[:3, :3].copy()
        self._height = float(up_camera @ (T_ideal[:3, :3] @ com + T_ideal[:3, 3]))

    def information(self, T: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Information matrix (6, 6) and gradient (6,) at a pose."""
        R = T[:3, :3]
        tilt = self._level @ rotation_log(R @ self._R.T)
        height = float(self._up @ (R @ self._com + T[:3, 3])) - self._height
        jacobian = np.zeros((3, 6))
        jacobian[:2, :3] = self._level @ R
        up_object = self._up @ R
        jacobian[2, :3] = np.cross(self._com, up_object)
        jacobian[2, 3:] = up_object
        residual = np.array([tilt[0], tilt[1], height])
        gain = 1.0 / np.array([TILT_SLACK, TILT_SLACK, HEIGHT_SLACK]) ** 2
        return jacobian.T @ (jacobian * gain[:, None]), jacobian.T @ (gain * residual)


def _residuals(
    model: MeshModel, points_camera: FloatArray, T_camera_object: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Signed distances (N,) from the exact surface and their Jacobian (N, 6)."""
    T = inverse(T_camera_object)
    p = (
        points_camera[:, 0, None] * T[:3, 0]
        + points_camera[:, 1, None] * T[:3, 1]
        + points_camera[:, 2, None] * T[:3, 2]
        + T[:3, 3]
    )
    nearest, normal = model.raycasting.closest(p)
    away = p - nearest
    along = (away * normal).sum(axis=1)
    length = np.sqrt((away * away).sum(axis=1))
    # Beside an edge the way to the surface leaves the face's normal; on a face, and where the
    # way is too short to have a direction, they agree.
    beside = (np.abs(along) < 0.95 * length) & (length > 5e-5)
    sign = np.where(along < 0, -1.0, 1.0)
    safe = np.where(length > 0, length, 1.0)
    gradient = np.where(beside[:, None], sign[:, None] * away / safe[:, None], normal)
    residual = np.where(beside, sign * length, along)
    jacobian = np.concatenate([-np.cross(p, gradient), -gradient], axis=1)
    return residual, jacobian


def _weighted_gram(jacobian: FloatArray, gain: FloatArray) -> FloatArray:
    """J^T diag(gain) J without BLAS, whose rounding may depend on the number of threads."""
    product = jacobian[:, :, None] * (jacobian * gain[:, None])[:, None, :]
    result: FloatArray = product.sum(axis=0)
    return result


def _spread(residual: FloatArray, weight: FloatArray, noise: float) -> float:
    """Robust standard deviation of the residuals, not below most of the table's noise [m]."""
    inlying = np.abs(residual[weight > 0.25])
    spread = 1.4826 * float(np.median(inlying)) if len(inlying) else 0.0
    return max(spread, 0.7 * noise)


def _vague() -> FloatArray:
    """Information of knowing nothing: keeps unobservable directions where they started."""
    return np.diag([UNKNOWN_TURN**-2.0] * 3 + [UNKNOWN_PLACE**-2.0] * 3)


def _systematic(
    T_camera_object: FloatArray, points_camera: FloatArray, profile: SensorProfile
) -> FloatArray:
    """Covariance (6, 6) of what averaging does not reduce: the sensor's bias, the print's error."""
    ray = points_camera.mean(axis=0)
    ray = T_camera_object[:3, :3].T @ (ray / np.linalg.norm(ray))
    result = np.zeros((6, 6))
    result[3:, 3:] = profile.bias**2 * np.outer(ray, ray) + PRINT_ERROR**2 * np.eye(3)
    return result


def _orthonormal(rotation: FloatArray) -> FloatArray:
    x = rotation[:, 0] / np.linalg.norm(rotation[:, 0])
    y = rotation[:, 1] - (rotation[:, 1] @ x) * x
    y /= np.linalg.norm(y)
    return np.column_stack([x, y, np.cross(x, y)])
