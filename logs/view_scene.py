"""The view's three-dimensional part: robot, hand, object, camera and cloud."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import rerun as rr

from logs import view_colors as colors
from logs.descriptions import (
    GRIPPER_DESCRIPTION,
    GRIPPER_FRAME,
    ROBOT_DESCRIPTION,
    Link,
    Shape,
    read_gripper,
    read_robot,
)
from logs.mesh_attachment import OBJECT_MESH, read_mesh
from logs.streams import CameraRecord, DepthImage, FrameTrack
from logs.trial_record import TrialRecord
from logs.view_stage import Stage, placed
from reach.arrays import FloatArray, IntArray
from reach.gripper import Box, Jaw, ParallelJawGripper
from reach.transforms import inverse, make_transform

Show = Callable[..., None]
"""Draws archetypes at an entity."""
WORLD = "world"
OBJECT = f"{WORLD}/object"
SCENE_ANCHOR = f"{WORLD}/eye"
"""From here the scene is looked at: where the object was found."""
TRUTH_FRAME = "object_truth"
"""Frame of a simulated object's true pose; never part of a blind view."""
CLOUD_POINTS = 60_000
"""More points make the viewer slow and the picture no clearer."""
TABLE_SIZE = 0.8
OPENED_AGAIN = 2e-3
"""A held object is let go when the jaws open by this much [m]."""


def show_scene(stage: Stage, record: TrialRecord, *, blind: bool) -> None:
    """Draw everything that stands or moves in the world."""
    stage.static(WORLD, rr.ViewCoordinates.RIGHT_HAND_Z_UP)
    stage.static(SCENE_ANCHOR, rr.Transform3D(translation=believed_pose(record)[:3, 3]))
    _show_table(stage, record)
    gripper = recorded_gripper(record)
    if GRIPPER_FRAME not in record.frames:
        gripper = None
    _show_robot(stage, record, skip_hand=gripper is not None)
    if gripper is not None:
        _show_gripper(stage, record, gripper)
        _show_planned_grasp(stage, record, gripper)
    _show_object(stage, record, blind=blind)
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


# ---- robot and hand --------------------------------------------------------------------------


def _show_robot(stage: Stage, record: TrialRecord, *, skip_hand: bool) -> None:
    attached = record.attachments.get(ROBOT_DESCRIPTION)
    if attached is None:
        return
    for link in read_robot(attached.data).links:
        track = record.frames.get(link.name)
        if track is None or (skip_hand and link.name == GRIPPER_FRAME):
            continue
        entity = f"{WORLD}/robot/{link.name}"
        stage.poses(entity, track.time_ns, track.transforms())
        _show_link(stage, entity, link)


def _show_link(stage: Stage, entity: str, link: Link) -> None:
    for number, shape in enumerate(link.shapes):
        inner = f"{entity}/{shape.type}_{number}"
        stage.static(inner, placed(np.array(shape.T_link_shape)), _solid(shape))


def _solid(shape: Shape) -> Any:
    size = shape.size
    color = colors.LINK if shape.type in ("box", "capsule") else colors.JOINTED
    if shape.rgba is not None:
        color = tuple(round(255 * share) for share in shape.rgba)  # type: ignore[assignment]
    style = {"colors": [color], "fill_mode": "solid"}
    if shape.type == "box":
        return rr.Boxes3D(sizes=[size], **style)
    if shape.type == "sphere":
        return rr.Ellipsoids3D(radii=[size[0]], **style)
    if shape.type == "cylinder":
        return rr.Cylinders3D(radii=[size[0]], lengths=[size[1]], **style)
    # A capsule's frame is in its middle; Rerun's begins at one end.
    start = (0.0, 0.0, -0.5 * size[1])
    return rr.Capsules3D(radii=[size[0]], lengths=[size[1]], translations=[start], **style)


def recorded_gripper(record: TrialRecord) -> ParallelJawGripper | None:
    """The hand that the record describes, if any."""
    attached = record.attachments.get(GRIPPER_DESCRIPTION)
    return None if attached is None else read_gripper(attached.data)


def _show_gripper(stage: Stage, record: TrialRecord, gripper: ParallelJawGripper) -> None:
    track = record.frames[GRIPPER_FRAME]
    hand = f"{WORLD}/hand"
    stage.poses(hand, track.time_ns, track.transforms())
    _show_boxes(stage.static, f"{hand}/palm", gripper.palm, colors.PALM)
    show_fingers(stage.static, hand, gripper)
    widths = np.clip(record.jaw.widths, 0.0, gripper.max_opening)
    for number, jaw in enumerate(gripper.jaws):
        entity = f"{hand}/jaw_{number}"
        travel = 0.5 * (gripper.max_opening - widths)[:, None] * jaw.T_gripper_pad_open[:3, 2]
        moved = np.tile(np.eye(4), (len(widths), 1, 1))
        moved[:, :3, 3] = travel
        stage.poses(entity, record.jaw.time_ns, moved)


def show_fingers(show: Show, hand: str, gripper: ParallelJawGripper) -> None:
    """Draw each jaw's solids and pad, at full opening, below its own entity `jaw_N`."""
    for number, jaw in enumerate(gripper.jaws):
        entity = f"{hand}/jaw_{number}"
        _show_boxes(show, f"{entity}/finger", jaw.boxes, colors.FINGER)
        _show_pad(show, f"{entity}/pad", jaw)


def _show_boxes(show: Show, entity: str, boxes: tuple[Box, ...], color: colors.Color) -> None:
    for number, box in enumerate(boxes):
        solid = rr.Boxes3D(half_sizes=[box.half_extents], colors=[color], fill_mode="solid")
        show(f"{entity}_{number}", placed(box.T_gripper_box), solid)


def _show_pad(show: Show, entity: str, jaw: Jaw) -> None:
    """The soft layer: the outline, from its face back by its thickness."""
    outline = jaw.pad.polygon
    count = len(outline)
    front = np.column_stack([outline, np.zeros(count)])
    back = front - (0.0, 0.0, jaw.pad.thickness)
    fan = [(0, i, i + 1) for i in range(1, count - 1)]
    faces = [*fan, *[(count + a, count + c, count + b) for a, b, c in fan]]
    for i in range(count):
        j = (i + 1) % count
        faces += [(i, count + i, count + j), (i, count + j, j)]
    mesh = flat_mesh(np.vstack([front, back])[np.array(faces)], colors.PAD)
    show(entity, placed(jaw.T_gripper_pad_open), mesh)


def _show_planned_grasp(stage: Stage, record: TrialRecord, gripper: ParallelJawGripper) -> None:
    """Outlines of the open pads where the plan wanted them on the object as it was found."""
    planned = record.descriptor.planned
    T_world_gripper = believed_pose(record) @ planned.T_object_gripper
    strips = []
    for number, jaw in enumerate(gripper.jaws):
        T = T_world_gripper @ gripper.T_gripper_pad(number, planned.opening)
        outline = np.column_stack([jaw.pad.polygon, np.zeros(len(jaw.pad.polygon))])
        strips.append(np.vstack([outline, outline[:1]]) @ T[:3, :3].T + T[:3, 3])
    stage.static(
        f"{WORLD}/planned_pads",
        rr.LineStrips3D(strips, colors=[colors.PLANNED], radii=[0.0006]),
    )


# ---- the object ------------------------------------------------------------------------------


def _show_object(stage: Stage, record: TrialRecord, *, blind: bool) -> None:
    stage.poses(OBJECT, *object_track(record))
    triangles = object_triangles(record)
    if triangles is None:
        return
    stage.static(f"{OBJECT}/mesh", flat_mesh(triangles, colors.OBJECT))
    stage.static(f"{OBJECT}/glass", flat_mesh(triangles, colors.OBJECT_GLASS))
    truth = record.frames.get(TRUTH_FRAME)
    if truth is not None and not blind:
        stage.poses(f"{WORLD}/truth", truth.time_ns, truth.transforms())
        stage.static(f"{WORLD}/truth/mesh", flat_mesh(triangles, colors.TRUTH))
    found = record.registration
    for number, rival in enumerate(found.rivals if found else ()):
        entity = f"{WORLD}/rivals/{number}"
        stage.static(entity, placed(rival.T_world_object), flat_mesh(triangles, colors.RIVAL))


def object_triangles(record: TrialRecord) -> FloatArray | None:
    """The object's triangles, object frame, shape (F, 3, 3) [m]; None if no mesh is attached."""
    attached = record.attachments.get(OBJECT_MESH)
    if attached is None:
        return None
    vertices, faces = read_mesh(attached.data)
    return vertices[faces]


def object_diameter(record: TrialRecord) -> float:
    """Diagonal of the object's bounding box [m]; a plausible one if no mesh is attached."""
    triangles = object_triangles(record)
    return 0.05 if triangles is None else float(np.linalg.norm(np.ptp(triangles, axis=(0, 1))))


def believed_pose(record: TrialRecord) -> FloatArray:
    """T_world_object as it was found, or as it was planned if it was not, shape (4, 4)."""
    found = record.registration
    return found.T_world_object if found else record.descriptor.T_world_object


def object_track(record: TrialRecord) -> tuple[IntArray, FloatArray]:
    """Where the object is believed to be: as it was found, then carried by the hand.

    Returns:
        Times (N,) [ns] and T_world_object (N, 4, 4).
    """
    times, poses = [record.descriptor.time_ns], [believed_pose(record)]
    carried = _carried(record)
    if carried is not None:
        track, during = carried
        T_gripper_object = inverse(record.executions[-1].executed.T_object_gripper)
        times.extend(track.time_ns[during].tolist())
        poses.extend(track.transforms()[during] @ T_gripper_object)
    return np.array(times, dtype=np.int64), np.stack(poses)


def _carried(record: TrialRecord) -> tuple[FrameTrack, Any] | None:
    """The hand's track and which samples of it carry the object."""
    execution, track = record.execution, record.frames.get(GRIPPER_FRAME)
    if execution is None or track is None or execution.sensor_verdict != "held":
        return None
    jaw = record.jaw
    after = jaw.time_ns >= execution.time_ns
    closed = jaw.widths[after][:1]
    opened = after & (jaw.widths > (closed[0] if len(closed) else np.inf) + OPENED_AGAIN)
    until = jaw.time_ns[opened][0] if opened.any() else track.time_ns[-1]
    return track, (track.time_ns >= execution.time_ns) & (track.time_ns <= until)


def flat_mesh(triangles: FloatArray, color: Any, vertex_colors: Any = None) -> Any:
    """Triangles (F, 3, 3) with one normal a face, so that edges stay edges.

    A hundred thousand faces are drawn and sent as they are; vertices are not shared.
    """
    corners = triangles.reshape(-1, 3).astype(np.float32)
    cross = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    length = np.linalg.norm(cross, axis=1, keepdims=True)
    normals = np.divide(cross, length, out=np.zeros_like(cross), where=length > 0)
    return rr.Mesh3D(
        vertex_positions=corners,
        triangle_indices=np.arange(len(corners), dtype=np.uint32).reshape(-1, 3),
        vertex_normals=np.repeat(normals, 3, axis=0).astype(np.float32),
        albedo_factor=None if vertex_colors is not None else color,
        vertex_colors=vertex_colors,
    )


# ---- camera and cloud ------------------------------------------------------------------------


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
