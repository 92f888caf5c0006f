"""Registration with Open3D's stock methods, on the same segmented clouds: what we compare with.

All get the candidate's points with the table already cut away, and the declared stable pose's
candidates where they can use them; none of them can refuse.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import open3d

from reach import GraspObject
from reach.arrays import FloatArray
from reach.stable_poses import StablePose
from reach.transforms import inverse
from registration.hypotheses import planar_starts
from registration.job import Job
from registration.render_check import render_check

Method = Callable[[Job, StablePose, int], FloatArray]
MODEL_POINTS = 3000
STARTS_TAKEN = 2
"""Many-start ICP starts from every second yaw (10 degrees)."""


def ransac_icp(job: Job, pose: StablePose, seed: int) -> FloatArray:
    """FPFH features, RANSAC, then point-to-plane ICP."""
    voxel = _voxel(job.obj)
    source, target = _observed(job, voxel), _model(job.obj, voxel)
    r = open3d.pipelines.registration
    open3d.utility.random.seed(seed)
    found = r.registration_ransac_based_on_feature_matching(
        source,
        target,
        _features(source, voxel),
        _features(target, voxel),
        False,
        1.5 * voxel,
        r.TransformationEstimationPointToPoint(False),
        3,
        [
            r.CorrespondenceCheckerBasedOnEdgeLength(0.9),
            r.CorrespondenceCheckerBasedOnDistance(1.5 * voxel),
        ],
        r.RANSACConvergenceCriteria(50_000, 0.999),
    )
    return _icp(job, found.transformation)


def fast_global_icp(job: Job, pose: StablePose, seed: int) -> FloatArray:
    """Fast global registration on FPFH features, then point-to-plane ICP."""
    voxel = _voxel(job.obj)
    source, target = _observed(job, voxel), _model(job.obj, voxel)
    r = open3d.pipelines.registration
    open3d.utility.random.seed(seed)
    found = r.registration_fgr_based_on_feature_matching(
        source,
        target,
        _features(source, voxel),
        _features(target, voxel),
        r.FastGlobalRegistrationOption(maximum_correspondence_distance=0.5 * voxel),
    )
    return _icp(job, found.transformation)


def many_start_icp(job: Job, pose: StablePose, seed: int) -> FloatArray:
    """ICP from the declared stable pose at many yaws; our render check chooses."""
    seen = job.groups[0].seen
    T_camera_table = job.table.T_camera_table(seen.points.mean(axis=0))
    voxel = _voxel(job.obj)
    source, target = _observed(job, voxel), _model(job.obj, voxel / 2)
    centroid = seen.points.mean(axis=0)
    found = []
    for start in planar_starts([pose])[::STARTS_TAKEN]:
        T = T_camera_table @ start
        facing = job.model.normals @ (T[:3, :3].T @ -centroid) > 0
        visible = job.model.samples[facing].mean(axis=0)
        T[:3, 3] += centroid - (T[:3, :3] @ visible + T[:3, 3])
        found.append(_run_icp(source, target, inverse(T), 10 * voxel / 3, 15))
    poses = np.stack([inverse(T) for T in found])
    check = render_check(job.model, seen, poses, stride=3, tolerance=3e-3)
    return _icp(job, found[int(np.argmin(check.cost))])


METHODS: dict[str, Method] = {
    "Open3D RANSAC + ICP": ransac_icp,
    "Open3D fast global + ICP": fast_global_icp,
    "Open3D many-start ICP + our render check": many_start_icp,
}


def _voxel(obj: GraspObject) -> float:
    return float(np.clip(obj.diameter / 30, 1.5e-3, 4e-3))


def _cloud(points: FloatArray) -> open3d.geometry.PointCloud:
    return open3d.geometry.PointCloud(open3d.utility.Vector3dVector(points))


def _observed(job: Job, voxel: float) -> open3d.geometry.PointCloud:
    cloud = _cloud(job.groups[0].seen.points).voxel_down_sample(voxel)
    cloud.estimate_normals(open3d.geometry.KDTreeSearchParamHybrid(3 * voxel, 30))
    cloud.orient_normals_towards_camera_location(np.zeros(3))
    return cloud


_models: dict[tuple[str, float], open3d.geometry.PointCloud] = {}


def _model(obj: GraspObject, voxel: float) -> open3d.geometry.PointCloud:
    """Surface points with normals; made once, as it would be in a station."""
    key = (obj.content_hash, voxel)
    if key not in _models:
        import trimesh

        points, faces = trimesh.sample.sample_surface(obj.mesh, 10 * MODEL_POINTS, seed=0)
        cloud = _cloud(points)
        cloud.normals = open3d.utility.Vector3dVector(obj.face_normals[faces])
        _models[key] = cloud.voxel_down_sample(voxel)
    return _models[key]


def _features(
    cloud: open3d.geometry.PointCloud, voxel: float
) -> open3d.pipelines.registration.Feature:
    return open3d.pipelines.registration.compute_fpfh_feature(
        cloud, open3d.geometry.KDTreeSearchParamHybrid(5 * voxel, 100)
    )


def _icp(job: Job, T_object_camera: FloatArray) -> FloatArray:
    """Refine at full resolution and return T_camera_object."""
    voxel = _voxel(job.obj) / 2
    source, target = _observed(job, voxel), _model(job.obj, voxel / 2)
    return inverse(_run_icp(source, target, T_object_camera, 4 * voxel, 40))


def _run_icp(
    source: open3d.geometry.PointCloud,
    target: open3d.geometry.PointCloud,
    T_object_camera: FloatArray,
    distance: float,
    steps: int,
) -> FloatArray:
    r = open3d.pipelines.registration
    found = r.registration_icp(
        source,
        target,
        distance,
        T_object_camera,
        r.TransformationEstimationPointToPlane(),
        r.ICPConvergenceCriteria(max_iteration=steps),
    )
    return np.array(found.transformation)
