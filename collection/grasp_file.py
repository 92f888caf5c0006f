"""Reading a file of grasps: what `reach sample --json` writes, or a bare list of poses."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, ValidationError

from reach.errors import InvalidInputError, ReachError

if TYPE_CHECKING:
    from reach.arrays import FloatArray
    from reach.grasp import Grasp

ROUNDING = 0.02
"""A rotation this close to orthonormal is taken for one printed with few digits, and projected."""

Rows = tuple[tuple[float, ...], ...]


class StablePoseEntry(BaseModel):
    """How the part lies when the grasp is carried out."""

    model_config = ConfigDict(extra="ignore", frozen=True)

    index: int | None = None
    probability: float | None = None
    T_world_object: Rows


class GraspEntry(BaseModel):
    """One grasp; a user's own columns are ignored."""

    model_config = ConfigDict(extra="ignore", frozen=True)

    T_object_gripper: Rows
    stable_pose: StablePoseEntry | None = None
    force: float | None = None


class GraspDocument(BaseModel):
    """A file of grasps on one part."""

    model_config = ConfigDict(extra="ignore", frozen=True)

    object: str | None = None
    mesh: str | None = None
    mesh_unit: str = "m"
    gripper: str = "yumi"
    grasps: tuple[GraspEntry, ...] = Field(default=())


@dataclass(frozen=True, slots=True, eq=False)
class FileGrasp:
    """A grasp as read.

    Attributes:
        grasp: the grasp.
        T_world_object: how the part lies, shape (4, 4), or None if the file does not say.
    """

    grasp: Grasp
    T_world_object: FloatArray | None


def read_grasp_file(path: Path) -> GraspDocument:
    """Read a JSON document with a list `grasps`, or a bare list of 4 x 4 poses of the gripper.

    Raises:
        InvalidInputError: unreadable, no JSON, or not of that form.
    """
    try:
        content = json.loads(path.read_text())
    except (OSError, UnicodeDecodeError, json.JSONDecodeError) as error:
        raise InvalidInputError(f"cannot read grasps from {str(path)!r}: {error}") from error
    if isinstance(content, list):
        content = {"grasps": [_entry(item) for item in content]}
    try:
        document = GraspDocument.model_validate(content)
    except ValidationError as error:
        first = error.errors()[0]
        where = ".".join(map(str, first["loc"])) or "document"
        raise InvalidInputError(f"grasps in {str(path)!r}: {where}: {first['msg']}") from error
    if not document.grasps:
        raise InvalidInputError(f"{str(path)!r} holds no grasps")
    return document


def _entry(item: Any) -> Any:
    return item if isinstance(item, dict) else {"T_object_gripper": item}


def grasps_of(document: GraspDocument, force: float) -> list[FileGrasp]:
    """Turn a document into grasps.

    Args:
        document: as read.
        force: closing force of grasps that state none [N].

    Raises:
        InvalidInputError: a pose is not rigid; the message names the grasp.
    """
    from reach.grasp import Grasp

    found = []
    for index, entry in enumerate(document.grasps):
        try:
            grasp = Grasp(
                rigid(entry.T_object_gripper, "T_object_gripper"),
                force=force if entry.force is None else entry.force,
            )
            lying = entry.stable_pose
            pose = None if lying is None else rigid(lying.T_world_object, "T_world_object")
        except ReachError as error:
            raise InvalidInputError(f"grasp {index}: {error}") from error
        found.append(FileGrasp(grasp, pose))
    return found


def rigid(rows: Rows, name: str) -> FloatArray:
    """Read a transform, projecting a rotation that is off orthonormal by rounding only.

    Raises:
        InvalidTransformError: not 4 x 4, not finite, or no rotation even within rounding.
    """
    from reach.transforms import as_transform, project_to_rotation

    try:
        T = np.array(rows, dtype=float)
    except ValueError:
        T = np.empty(0)  # rows of different lengths: refused below, by shape
    if T.shape == (4, 4) and np.isfinite(T).all():
        rotation = T[:3, :3]
        if (
            np.abs(rotation.T @ rotation - np.eye(3)).max() < ROUNDING
            and np.linalg.det(rotation) > 0
        ):
            T[:3, :3] = project_to_rotation(rotation)
    return as_transform(T, name)
