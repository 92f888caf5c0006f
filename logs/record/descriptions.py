"""Shapes of robot and gripper as attachments of a record: plain JSON that any viewer can draw.

`robot.json`: links with primitive shapes; each link's pose over time is a frame of the record
with the link's name. `gripper.json`: the whole hand, so that a record can be scored again
without this release's gripper.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Annotated, Literal

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, ValidationError

from logs.errors import RecordReadError
from logs.record.records import AttachmentRecord
from reach.arrays import FloatArray
from reach.gripper import Box, Jaw, Pad, ParallelJawGripper

ROBOT_DESCRIPTION = "robot.json"
GRIPPER_DESCRIPTION = "gripper.json"
STATION_FILE = "station.toml"
JSON = "application/json"
GRIPPER_FRAME = "gripper"
"""Name of the gripper's frame in a record."""

Number = Annotated[float, Field(allow_inf_nan=False)]
Positive = Annotated[float, Field(gt=0, allow_inf_nan=False)]
Share = Annotated[float, Field(ge=0, le=1)]
Matrix = Annotated[
    tuple[tuple[Number, Number, Number, Number], ...], Field(min_length=4, max_length=4)
]
IDENTITY: Matrix = ((1, 0, 0, 0), (0, 1, 0, 0), (0, 0, 1, 0), (0, 0, 0, 1))


class _Model(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True)


class Shape(_Model):
    """A primitive shape of a link.

    `size` [m]: box: full extents (x, y, z); sphere: (radius,); cylinder and capsule: (radius,
    length along z; a capsule's without its caps). The frame is in the shape's center.
    """

    type: Literal["box", "sphere", "cylinder", "capsule"]
    size: Annotated[tuple[Positive, ...], Field(min_length=1, max_length=3)]
    T_link_shape: Matrix = IDENTITY
    rgba: tuple[Share, Share, Share, Share] | None = None


class Link(_Model):
    """A link and its shapes."""

    name: str
    shapes: tuple[Shape, ...]


class RobotDescription(_Model):
    """A robot's links."""

    links: tuple[Link, ...]


class _Box(_Model):
    T_gripper_box: Matrix
    half_extents: tuple[Positive, Positive, Positive]


class _Jaw(_Model):
    polygon: tuple[tuple[Number, Number], ...]
    thickness: Positive
    max_deformation: Positive
    T_gripper_pad_open: Matrix
    boxes: tuple[_Box, ...]


class _Gripper(_Model):
    name: str
    stroke: Positive
    max_force: Positive
    max_speed: Positive
    palm: tuple[_Box, ...]
    jaws: tuple[_Jaw, ...]


def robot_attachment(description: RobotDescription) -> AttachmentRecord:
    """The robot's shapes as a file of the record."""
    return AttachmentRecord(ROBOT_DESCRIPTION, JSON, description.model_dump_json().encode())


def read_robot(data: bytes) -> RobotDescription:
    """The robot's shapes.

    Raises:
        RecordReadError: if the file is no robot description.
    """
    try:
        return RobotDescription.model_validate_json(data)
    except ValidationError as error:
        raise RecordReadError(f"the record's {ROBOT_DESCRIPTION} is wrong: {error}") from error


def gripper_attachment(gripper: ParallelJawGripper) -> AttachmentRecord:
    """The hand as a file of the record."""
    described = _Gripper(
        name=gripper.name,
        stroke=gripper.stroke,
        max_force=gripper.max_force,
        max_speed=gripper.max_speed,
        palm=_boxes(gripper.palm),
        jaws=tuple(
            _Jaw(
                polygon=jaw.pad.polygon.tolist(),
                thickness=jaw.pad.thickness,
                max_deformation=jaw.pad.max_deformation,
                T_gripper_pad_open=_rows(jaw.T_gripper_pad_open),
                boxes=_boxes(jaw.boxes),
            )
            for jaw in gripper.jaws
        ),
    )
    return AttachmentRecord(GRIPPER_DESCRIPTION, JSON, described.model_dump_json().encode())


def read_gripper(data: bytes) -> ParallelJawGripper:
    """The hand, bit for bit.

    Raises:
        RecordReadError: if the file is no gripper description.
    """
    try:
        described = _Gripper.model_validate_json(data)
    except ValidationError as error:
        raise RecordReadError(f"the record's {GRIPPER_DESCRIPTION} is wrong: {error}") from error
    return ParallelJawGripper(
        name=described.name,
        jaws=tuple(
            Jaw(
                Pad(np.array(jaw.polygon), jaw.thickness, jaw.max_deformation),
                np.array(jaw.T_gripper_pad_open),
                tuple(_box(box) for box in jaw.boxes),
            )
            for jaw in described.jaws
        ),
        stroke=described.stroke,
        max_force=described.max_force,
        max_speed=described.max_speed,
        palm=tuple(_box(box) for box in described.palm),
    )


def _rows(T: FloatArray) -> Matrix:
    rows: Matrix = tuple(tuple(row) for row in T.tolist())
    return rows


def _boxes(boxes: Sequence[Box]) -> tuple[_Box, ...]:
    return tuple(
        _Box(T_gripper_box=_rows(box.T_gripper_box), half_extents=tuple(box.half_extents.tolist()))
        for box in boxes
    )


def _box(box: _Box) -> Box:
    return Box(np.array(box.T_gripper_box), np.array(box.half_extents))
