"""The last refinement: exact distances, the table's support, and an honest covariance.

The pose is the maximum a posteriori under two kinds of evidence: observed points lie on the
surface, and the part stands on the table. Neighboring depths share their errors, so N points
count as N divided by the correlation area measured on the table.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from reach.arrays import FloatArray
from reach.symmetry import Symmetry
from reach.transforms import exp, inverse, skew
from registration.free_turns import told_directions
from registration.mesh_model import MeshModel
from registration.observation import Observation
from registration.support import Support

POINTS = 1500
STEPS = 4
SHALLOW = 0.3
"""Depths of a face seen at less than this cosine are not taken to lie any deeper for it."""
PRINT_ERROR = 1e-5
"""Standard deviation of the part's shape against its mesh, averaged over the part: an offset of
the whole pose [m]."""
SHARED_ERROR = 1e-5
"""Standard deviation of the error that the part's depths share and the table's do not [m]; what both
share is the calibration's."""
UNKNOWN_TURN, UNKNOWN_PLACE = np.pi / np.sqrt(3.0), 0.1
"""Standard deviations of a direction that nothing tells about [rad, m]: a turn that may be any."""
RIM, RIM_ERROR = 0.25, 0.15
"""Points on faces seen at less than this cosine tell where the part's rim is; they share an error,
in pixels: those that noise moved outward are taken for the face beyond the edge."""
SLOPES = (0.4, 0.55, 0.7, 0.85)
"""Faces are told apart by the cosine between ray and normal when their depths' noise is measured."""
FEWEST = 60
"""Points that a measure of their noise needs."""


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
    support: Support | None,
    sym: Symmetry,
) -> Polished:
    """Refine one pose and tell how well it is known.

    About an axis of symmetry it stays as it was; the covariance there is that of any turn.

    Args:
        model: of the part.
        seen: the image's window.
        T_camera_object: start, shape (4, 4).
        support: what the table says of height and tilt; None if the part may lie in any way.
        sym: of the part.
    """
    told = told_directions(sym)
    noise = seen.table.noise / seen.table.slope(seen.points.mean(axis=0))
    count = min(POINTS, len(seen.points))
    points = seen.points[np.arange(count) * len(seen.points) // count]
    effective = _effective(count, len(seen.points), seen.table.correlation_area)
    scale = max(0.4e-3, 3 * noise)
    pixel = float(points[:, 2].mean()) / seen.frame.intrinsics.fx
    T = np.array(T_camera_object)
    for step in range(STEPS + 1):
        residual, jacobian, cosine = _in_depth(*_residuals(model, points, T), points, T)
        weight = (scale**2 / (scale**2 + residual**2)) ** 2
        sigma = _spread(residual, weight, cosine, noise)
        gain = weight / sigma**2 * (_efficiency(residual / sigma, weight) * effective / count)
        gain *= _rim_share(gain, cosine, RIM_ERROR * pixel / SHALLOW)
        information = told.T @ _weighted_gram(jacobian, gain) @ told
        gradient = (jacobian * (gain * residual)[:, None]).sum(axis=0)
        total = information + _vague(model.obj.com)
        if support is not None:
            prior, pull = support.information(T)
            total, gradient = total + told.T @ prior @ told, gradient + pull
        gradient = told.T @ gradient
        if step == STEPS:
            break
        T = T @ exp(-np.linalg.solve(total, gradient))
    T[:3, :3] = _orthonormal(T[:3, :3])
    residual, _ = _residuals(model, points, T)
    near = np.abs(residual) < max(3 * seen.table.noise, 0.5e-3)
    covariance = np.linalg.inv(total) + _systematic(T, points)
    return Polished(
        T,
        0.5 * (covariance + covariance.T),
        information,
        fitness=float(near.mean()),
        rmse=float(np.sqrt(np.mean(residual[near] ** 2))) if near.any() else float("inf"),
    )


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


def _in_depth(
    residual: FloatArray, jacobian: FloatArray, points_camera: FloatArray, T: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Residuals (N,) and Jacobian (N, 6) along the rays, where the sensor errs, and |cosines| (N,).

    A depth's error moves a point across a face seen at a slant by less: such faces, the walls
    that tell how a part is turned, are known better than their share of points says.
    """
    ray = points_camera / np.sqrt((points_camera**2).sum(axis=1))[:, None]
    normal = (jacobian[:, None, 3:] * T[None, :3, :3]).sum(axis=2)
    cosine = np.abs((normal * ray).sum(axis=1))
    slope = np.maximum(cosine, SHALLOW)
    return residual / slope, jacobian / slope[:, None], cosine


def _effective(count: int, total: int, correlation_area: float) -> float:
    """How many independent points some spread evenly over all points are worth.

    Neighbors in a thinned set still share a little; counting it held 99 % within the 90 % ellipsoid.
    """
    return min(float(count), total / correlation_area)


def _rim_share(gain: FloatArray, cosine: FloatArray, rim_error: float) -> FloatArray:
    """What is left of the information (N,) of points at the rim, as they share a depth error [m]."""
    rim = cosine < RIM
    told = float(gain[rim].sum())
    return np.where(rim, 1.0 / (1.0 + told * rim_error**2), 1.0)


def _weighted_gram(jacobian: FloatArray, gain: FloatArray) -> FloatArray:
    """J^T diag(gain) J without BLAS, whose rounding may depend on the number of threads."""
    product = jacobian[:, :, None] * (jacobian * gain[:, None])[:, None, :]
    result: FloatArray = product.sum(axis=0)
    return result


def _spread(
    residual: FloatArray, weight: FloatArray, cosine: FloatArray, noise: float
) -> FloatArray:
    """Robust standard deviation of each residual (N,), by the slant of its face [m].

    It is measured on the part: depths of faces seen at a slant err more than the table's. It is
    no less than most of the table's noise, and no less than that of less slanted faces.
    """
    inlying = weight > 0.25
    sigma = np.empty(len(residual))
    least = 0.7 * noise
    slant = np.digitize(cosine, SLOPES)
    for kind in range(len(SLOPES), -1, -1):
        own = slant == kind
        known = np.abs(residual[own & inlying])
        if len(known) >= FEWEST:
            least = max(least, 1.4826 * float(np.median(known)))
        sigma[own] = least
    return sigma


def _efficiency(standard: FloatArray, weight: FloatArray) -> float:
    """What a robust fit's weighted residuals (N,) tell, over what their weights alone would say.

    The variance of an M-estimate is E[psi^2] / E[psi']^2, not sigma^2 / E[psi / r] ([Huber1981]).

    Args:
        standard: residuals in units of their standard deviations, shape (N,).
        weight: psi / r of each, shape (N,).
    """
    steepness = float((weight * (4 * np.sqrt(weight) - 3)).mean())
    power = float(((weight * standard) ** 2).mean())
    if power <= 0.0:
        return 1.0
    return float(np.clip(steepness**2 / (power * weight.mean()), 0.5, 1.2))


def _vague(com: FloatArray) -> FloatArray:
    """Information of knowing nothing: keeps unobservable directions where they started."""
    to_com = np.eye(6)
    to_com[3:, :3] = -skew(com)
    vague = np.diag([UNKNOWN_TURN**-2.0] * 3 + [UNKNOWN_PLACE**-2.0] * 3)
    result: FloatArray = to_com.T @ vague @ to_com
    return result


def _systematic(T_camera_object: FloatArray, points_camera: FloatArray) -> FloatArray:
    """Covariance (6, 6) of what averaging does not reduce: along the view, and the print's."""
    ray = points_camera.mean(axis=0)
    ray = T_camera_object[:3, :3].T @ (ray / np.linalg.norm(ray))
    result = np.zeros((6, 6))
    result[3:, 3:] = SHARED_ERROR**2 * np.outer(ray, ray) + PRINT_ERROR**2 * np.eye(3)
    return result


def _orthonormal(rotation: FloatArray) -> FloatArray:
    x = rotation[:, 0] / np.linalg.norm(rotation[:, 0])
    y = rotation[:, 1] - (rotation[:, 1] @ x) * x
    y /= np.linalg.norm(y)
    return np.column_stack([x, y, np.cross(x, y)])
