"""The view's world: table, cameras and clouds, with robot, hand and object."""

from __future__ import annotations

from typing import Any

import numpy as np
import rerun as rr

from logs.record.descriptions import GRIPPER_FRAME
from logs.record.streams import CameraRecord, DepthImage
from logs.record.trial_record import TrialRecord
from logs.view import colors
from logs.view.object import WORLD, believed_pose, show_object
from logs.view.robot import recorded_gripper, show_gripper, show_planned_grasp, show_robot
from logs.view.stage import Stage, placed
from reach.arrays import FloatArray
from reach.transforms import make_transform

CLOUD_POINTS = 60_000
"""More points make the viewer slow and the picture no clearer."""
TABLE_SIZE = 0.8


def show_scene(stage: Stage, record: TrialRecord, *, blind: bool) -> None:
    """Draw everything that stands or moves in the world."""
    stage.static(WORLD, rr.ViewCoordinates.RIGHT_HAND_Z_UP)
    _show_table(stage, record)
    gripper = recorded_gripper(record)
    if GRIPPER_FRAME not in record.frames:
        gripper = None
    show_robot(stage, record, skip_hand=gripper is not None)
    if gripper is not None:
        show_gripper(stage, record, gripper)
        show_planned_grasp(stage, record, gripper)
    show_object(stage, record, blind=blind)
    for camera in record.cameras.values():
        _show_camera(stage, camera)
    _show_clouds(stage, record)


def _show_table(stage: Stage, record: TrialRecord) -> None:
    center = believed_pose(record)[:3, 3] * (1, 1, 0) - (0, 0, 0.012)
    half = (TABLE_SIZE / 2, TABLE_SIZE / 2, 0.01)
    stage.static(
        f"{WORLD}/table",
        rr.Boxes3D(centers=[center], half_sizes=[half], colors=[colors.TABLE], fill_mode="solid"),
    )


def _show_camera(stage: Stage, camera: CameraRecord) -> None:
    entity = f"{WORLD}/cameras/{camera.name}"
    pinhole = rr.Pinhole(
        image_from_camera=[
            [camera.fx, 0, camera.cx],
            [0, camera.fy, camera.cy],
            [0, 0, 1],
        ],
        resolution=[camera.width, camera.height],
        image_plane_distance=0.06,
    )
    stage.static(entity, placed(camera.T_world_camera), pinhole)


def _show_clouds(stage: Stage, record: TrialRecord) -> None:
    for image in record.depth:
        camera = record.cameras.get(image.camera)
        if camera is not None:
            _show_points(stage, image.time_ns, *_cloud(record, image, camera))
    for cloud in record.clouds:
        camera = record.cameras.get(cloud.camera)
        T = camera.T_world_camera if camera else make_transform()
        points = cloud.points_camera @ T[:3, :3].T + T[:3, 3]
        kept = points[:: max(len(points) // CLOUD_POINTS, 1)]
        _show_points(stage, cloud.time_ns, kept, np.full((len(kept), 3), 170, np.uint8), 1e-3)


def _show_points(
    stage: Stage, time_ns: int, points_world: FloatArray, shades: Any, radius: float
) -> None:
    shown = rr.Points3D(points_world.astype(np.float32), colors=shades, radii=[radius])
    stage.at(f"{WORLD}/cloud", time_ns, shown)


def _cloud(
    record: TrialRecord, image: DepthImage, camera: CameraRecord
) -> tuple[FloatArray, Any, float]:
    """Every n-th pixel as a point of the world, in the color frame's colors if one fits.

    Returns:
        Points (N, 3) [m], their colors (N, 3), and a radius that lets neighbors touch [m].
    """
    depth = image.meters()
    step = max(int(np.ceil(np.sqrt(depth.size / CLOUD_POINTS))), 1)
    thin = depth[::step, ::step].astype(float)
    v, u = np.mgrid[0 : depth.shape[0] : step, 0 : depth.shape[1] : step]
    seen = np.isfinite(thin)
    z = thin[seen]
    x, y = (u[seen] - camera.cx) / camera.fx * z, (v[seen] - camera.cy) / camera.fy * z
    T = camera.T_world_camera
    points = np.column_stack([x, y, z]) @ T[:3, :3].T + T[:3, 3]
    spacing = float(np.median(z)) * step / camera.fx if len(z) else 0.0
    return points, _shades(record, image, step, seen), max(0.6 * spacing, 1e-4)


def _shades(record: TrialRecord, image: DepthImage, step: int, seen: Any) -> Any:
    for frame in record.color:
        if frame.time_ns == image.time_ns:
            pixels = frame.pixels()
            if pixels.shape[:2] == image.depth.shape:
                return pixels[::step, ::step][seen]
    return np.full((int(seen.sum()), 3), 170, np.uint8)
