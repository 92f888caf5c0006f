"""Synthetic depth images with known poses, for the registration's benchmark and tests.

Two cameras: a structured-light one (fine, little noise, shadows of the projector) and a stereo
one (coarse, correlated noise, flying pixels at edges, holes). They are written apart from the
station's simulated cameras, so that registration is not tuned to one model of a sensor.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from scipy import ndimage

from reach import GraspObject
from reach.arrays import FloatArray
from reach.stable_poses import stable_poses
from reach.transforms import exp, make_transform, rotation_about
from registration.frame import DepthFrame, Intrinsics

CAMERAS = {
    "structured-light": Intrinsics(720, 560, 1710.0, 1710.0, 359.5, 279.5),
    "stereo": Intrinsics(640, 480, 860.0, 860.0, 319.5, 239.5),
}
"""Pitch on the table, at 0.6 m: 0.35 mm and 0.7 mm."""


@dataclass(frozen=True)
class SceneSettings:
    """What a laboratory's table looks like.

    Args:
        sensor: a key of CAMERAS.
        offset: largest distance of the part from the table's middle along x and y [m].
        aim: where on the table the image's middle is, in the camera's right and back, (2,) [m].
        table_tilt: angle between the real table and the world's horizontal [rad].
        calibration_error: translation error of the camera's pose as known [m].
        others: further parts on the table: pose in world, shape (4, 4).
        noise: multiplies the sensor's noise.
    """

    sensor: str = "structured-light"
    offset: float = 0.02
    aim: tuple[float, float] = (0.0, 0.0)
    table_tilt: float = 0.0
    calibration_error: float = 0.0
    others: Sequence[tuple[GraspObject, FloatArray]] = field(default=())
    noise: float = 1.0


@dataclass(frozen=True)
class RegistrationCase:
    """One image with its truth, in the camera's frame (free of calibration error)."""

    obj: GraspObject
    frame: DepthFrame
    stable_pose: int
    T_camera_object: FloatArray


def make_case(
    obj: GraspObject | None,
    rng: np.random.Generator,
    settings: SceneSettings,
    stable_pose: int | None = None,
) -> RegistrationCase:
    """Put a part (or none) on a table at a random place and look at it obliquely."""
    T_world_table = make_transform(rotation_about(_horizontal(rng), settings.table_tilt))
    T_world_camera = _camera_pose(rng, settings.aim)
    solids = list(settings.others)
    T_world_object, chosen = make_transform(), 0
    if obj is not None:
        chosen, T_table_object = _placement(obj, rng, settings, stable_pose)
        T_world_object = T_world_table @ T_table_object
        solids.append((obj, T_world_object))
    depth = _capture(solids, T_world_table, T_world_camera, settings, rng)
    error = np.concatenate([np.zeros(3), settings.calibration_error * _direction(rng)])
    frame = DepthFrame(
        depth, CAMERAS[settings.sensor], T_world_camera @ exp(error), sensor=settings.sensor
    )
    T_camera_object = np.linalg.inv(T_world_camera) @ T_world_object
    shown = obj if obj is not None else _tiny_cube()
    return RegistrationCase(shown, frame, chosen, T_camera_object)


def covered(case: RegistrationCase, share: float, rng: np.random.Generator) -> RegistrationCase:
    """Hide a share of the part's pixels behind something held in front of it, from one side."""
    rays = case.frame.intrinsics.rays()
    depth = np.array(case.frame.depth)
    hit, _ = _first_hit([(case.obj, case.T_camera_object)], rays, make_transform())
    v, u = np.nonzero(np.isfinite(hit))
    angle = rng.uniform(0, 2 * np.pi)
    along = u * np.cos(angle) + v * np.sin(angle)
    edge = np.quantile(along, 1 - share)
    vv, uu = np.indices(depth.shape)
    front = uu * np.cos(angle) + vv * np.sin(angle) > edge
    across = -uu * np.sin(angle) + vv * np.cos(angle)
    middle = np.median(-u * np.sin(angle) + v * np.cos(angle))
    half = 1.2 * np.ptp(-u * np.sin(angle) + v * np.cos(angle)) / 2
    hand = front & (np.abs(across - middle) < half)
    depth[hand] = np.nanmin(hit[np.isfinite(hit)]) - 0.05 + 2e-4 * rng.normal(size=hand.sum())
    return replace(case, frame=replace(case.frame, depth=depth))


def _placement(
    obj: GraspObject,
    rng: np.random.Generator,
    settings: SceneSettings,
    stable_pose: int | None,
) -> tuple[int, FloatArray]:
    poses = stable_poses(obj)
    weights = np.sqrt([pose.probability for pose in poses])  # rare poses are tried as well
    index = int(rng.choice(len(poses), p=weights / weights.sum()))
    index = index if stable_pose is None else stable_pose
    x, y = rng.uniform(-settings.offset, settings.offset, 2)
    T = make_transform(rotation_about((0, 0, 1), rng.uniform(0, 2 * np.pi)), (x, y, 0.0))
    return index, T @ poses[index].T_world_object


def _camera_pose(rng: np.random.Generator, aim: tuple[float, float]) -> FloatArray:
    """Camera 0.6 m from the point it aims at, looking 35 to 65 degrees down."""
    azimuth, elevation = rng.uniform(0, 2 * np.pi), np.radians(rng.uniform(35, 65))
    back = np.array(
        [
            np.cos(azimuth) * np.cos(elevation),
            np.sin(azimuth) * np.cos(elevation),
            np.sin(elevation),
        ]
    )
    z = -back
    x = np.cross(z, (0, 0, 1.0))
    x /= np.linalg.norm(x)
    target = aim[0] * x + aim[1] * np.cross((0, 0, 1.0), x)
    at = target + back * rng.uniform(0.55, 0.65)
    return make_transform(np.column_stack([x, np.cross(z, x), z]), at)


def _capture(
    solids: Sequence[tuple[GraspObject, FloatArray]],
    T_world_table: FloatArray,
    T_world_camera: FloatArray,
    settings: SceneSettings,
    rng: np.random.Generator,
) -> FloatArray:
    rays = CAMERAS[settings.sensor].rays()
    T_camera_world = np.linalg.inv(T_world_camera)
    in_camera = [(obj, T_camera_world @ T) for obj, T in solids]
    T_camera_table = T_camera_world @ T_world_table
    depth, normals = _first_hit(in_camera, rays, T_camera_table)
    if settings.sensor == "structured-light":
        return _structured_light(depth, normals, rays, in_camera, T_camera_table, settings, rng)
    return _stereo(depth, settings, rng)


def _structured_light(
    depth: FloatArray,
    normals: FloatArray,
    rays: FloatArray,
    solids: Sequence[tuple[GraspObject, FloatArray]],
    T_camera_table: FloatArray,
    settings: SceneSettings,
    rng: np.random.Generator,
) -> FloatArray:
    """Noise of 0.1 mm facing the camera to 0.3 mm grazing; no return in the projector's shadow."""
    points = rays * depth[..., None]
    cosine = np.abs((normals * rays).sum(-1)) / np.linalg.norm(rays, axis=-1)
    white = rng.normal(size=depth.shape)
    smooth = ndimage.gaussian_filter(rng.normal(size=depth.shape), 1.0) * 3.5
    sigma = settings.noise * (0.1e-3 + 0.2e-3 * (1 - cosine))
    noisy = depth + sigma * (0.8 * white + 0.6 * smooth)
    projector = np.array([0.12, 0.0, 0.0])
    lit = ~_shadowed(points + 2e-4 * normals, projector, solids)
    edge = np.abs(ndimage.laplace(depth)) > 4e-3
    lost = edge & (rng.random(depth.shape) < 0.7) | (rng.random(depth.shape) < 0.005)
    seen = lit & (cosine > np.cos(np.radians(80))) & ~lost
    return np.where(seen, noisy, np.nan).astype(np.float32)


def _stereo(depth: FloatArray, settings: SceneSettings, rng: np.random.Generator) -> FloatArray:
    """Noise of 1.2 to 2 mm over patches of pixels, flying pixels at edges, holes."""
    sigma = settings.noise * rng.uniform(1.2e-3, 2e-3)
    blurred = ndimage.gaussian_filter(depth, 1.2)
    at_edge = ndimage.maximum_filter(depth, 3) - ndimage.minimum_filter(depth, 3) > 8e-3
    mixed = np.where(at_edge, blurred, depth)
    scale = 2.5
    smooth = ndimage.gaussian_filter(rng.normal(size=depth.shape), scale)
    smooth *= 2 * scale * np.sqrt(np.pi)
    noisy = mixed + sigma * (0.9 * smooth + 0.44 * rng.normal(size=depth.shape))
    blobs = ndimage.gaussian_filter(rng.normal(size=depth.shape), 3) * 2 * 3 * np.sqrt(np.pi)
    holes = (blobs > 2.4) | (at_edge & (rng.random(depth.shape) < 0.3))
    return np.where(holes, np.nan, noisy).astype(np.float32)


def _first_hit(
    solids: Sequence[tuple[GraspObject, FloatArray]], rays: FloatArray, T_camera_table: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Depth (H, W) and normals (H, W, 3) of the nearest solid or the table, camera frame."""
    up, foot = T_camera_table[:3, 2], T_camera_table[:3, 3]
    slope = rays @ up
    with np.errstate(divide="ignore"):
        depth = np.where(slope < 0, (up @ foot) / slope, np.inf)
    normals = np.broadcast_to(up, rays.shape).copy()
    if T_camera_table is not None and np.allclose(T_camera_table, np.eye(4)):
        depth = np.full(rays.shape[:2], np.inf)  # no table
    for obj, T_camera_object in solids:
        answer = _cast(obj, T_camera_object, np.zeros_like(rays), rays)
        hit, normal = answer
        nearer = hit < depth
        depth = np.where(nearer, hit, depth)
        normals[nearer] = normal[nearer]
    return depth, normals


def _shadowed(
    points: FloatArray, projector: FloatArray, solids: Sequence[tuple[GraspObject, FloatArray]]
) -> FloatArray:
    dark = np.zeros(points.shape[:2], bool)
    for obj, T_camera_object in solids:
        hit, _ = _cast(obj, T_camera_object, points, projector - points)
        dark |= hit < 1.0
    return dark


def _cast(
    obj: GraspObject, T_camera_object: FloatArray, origins: FloatArray, directions: FloatArray
) -> tuple[FloatArray, FloatArray]:
    import open3d

    scene = open3d.t.geometry.RaycastingScene(nthreads=1)
    vertices = obj.vertices @ T_camera_object[:3, :3].T + T_camera_object[:3, 3]
    scene.add_triangles(
        open3d.core.Tensor(vertices.astype(np.float32)),
        open3d.core.Tensor(obj.faces.astype(np.uint32)),
    )
    rays = np.concatenate([origins, directions], axis=-1).astype(np.float32)
    answer = scene.cast_rays(open3d.core.Tensor(rays), nthreads=1)
    return answer["t_hit"].numpy().astype(float), answer["primitive_normals"].numpy().astype(float)


def _tiny_cube() -> GraspObject:
    from benchmarks.registration_objects import part

    return part("cube")


def _horizontal(rng: np.random.Generator) -> FloatArray:
    angle = rng.uniform(0, 2 * np.pi)
    return np.array([np.cos(angle), np.sin(angle), 0.0])


def _direction(rng: np.random.Generator) -> FloatArray:
    v = rng.normal(size=3)
    return np.asarray(v / np.linalg.norm(v))
