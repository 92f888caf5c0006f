"""The view's robot and hand, drawn from the record's descriptions and frames."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import rerun as rr

from logs.record.descriptions import (
    GRIPPER_DESCRIPTION,
    GRIPPER_FRAME,
    ROBOT_DESCRIPTION,
    Link,
    Shape,
    read_gripper,
    read_robot,
)
from logs.record.trial_record import TrialRecord
from logs.view import colors
from logs.view.object import WORLD, believed_pose
from logs.view.stage import Stage, flat_mesh, placed
from reach.gripper import Box, Jaw, ParallelJawGripper

Show = Callable[..., None]
"""Draws archetypes at an entity."""


def show_robot(stage: Stage, record: TrialRecord, *, skip_hand: bool) -> None:
    """Draw the robot's links, moving as recorded."""
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


def show_gripper(stage: Stage, record: TrialRecord, gripper: ParallelJawGripper) -> None:
    """Draw the hand, with jaws as wide as measured."""
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


def show_planned_grasp(stage: Stage, record: TrialRecord, gripper: ParallelJawGripper) -> None:
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
