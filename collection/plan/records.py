"""What a plan holds, as it is written to and read from a session's files."""

from __future__ import annotations

import hashlib
from functools import cached_property
from typing import Annotated, Any

import numpy as np
from pydantic import BaseModel, BeforeValidator, ConfigDict, PlainSerializer, ValidationError

from collection.errors import PlanError
from collection.sampling.options import SamplingOptions
from reach.arrays import FloatArray
from reach.transforms import as_transform


def _to_lists(matrix: FloatArray) -> list[list[float]]:
    rows: list[list[float]] = matrix.tolist()
    return rows


Transform = Annotated[
    np.ndarray[Any, Any], BeforeValidator(as_transform), PlainSerializer(_to_lists)
]
"""A rigid transform (4, 4); lists of rows in JSON, where every float survives exactly."""


class _Record(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True, arbitrary_types_allowed=True)

    def __eq__(self, other: object) -> bool:
        # Arrays have no single truth value: records are equal if they are written the same.
        return type(other) is type(self) and other.model_dump_json() == self.model_dump_json()

    def __hash__(self) -> int:
        return hash(self.model_dump_json())


class PlannedPose(_Record):
    """One way a part lies; `grasps` is how many of the plan's grasps are on it."""

    index: int
    probability: float
    T_world_object: Transform
    grasps: int


class PlannedObject(_Record):
    """A part, the poses to place it in, and what the operator should know of its planning."""

    name: str
    content_hash: str
    faces: int
    mass: float
    poses: tuple[PlannedPose, ...]
    notes: tuple[str, ...] = ()


class PlannedGrasp(_Record):
    """One grasp; angles in radians, lengths in meters."""

    grasp_id: str
    object_name: str
    stable_pose: int
    T_object_gripper: Transform
    T_object_gripper_parent: Transform
    width: float
    approach_angle: float
    contacts_object: tuple[tuple[float, float, float], tuple[float, float, float]]


class PlannedTrial(_Record):
    """One attempt of one grasp; `number` is its place in the session, from 1."""

    number: int
    trial_id: str
    grasp_id: str
    object_name: str
    repeat: int


class Plan(_Record):
    """All grasps and the order of their trials."""

    seed: int
    session: int
    gripper: str
    options: SamplingOptions
    objects: tuple[PlannedObject, ...]
    grasps: tuple[PlannedGrasp, ...]
    trials: tuple[PlannedTrial, ...]

    @cached_property
    def content_hash(self) -> str:
        """SHA-256 of the plan: two sessions with one hash follow one plan."""
        return hashlib.sha256(self.to_json().encode()).hexdigest()

    @cached_property
    def _grasps_by_id(self) -> dict[str, PlannedGrasp]:
        return {grasp.grasp_id: grasp for grasp in self.grasps}

    @cached_property
    def _objects_by_name(self) -> dict[str, PlannedObject]:
        return {part.name: part for part in self.objects}

    def grasp(self, grasp_id: str) -> PlannedGrasp:
        """The grasp of an identifier.

        Raises:
            PlanError: there is none.
        """
        if grasp_id not in self._grasps_by_id:
            raise PlanError(f"the plan has no grasp {grasp_id!r}")
        return self._grasps_by_id[grasp_id]

    def pose_of(self, grasp: PlannedGrasp) -> PlannedPose:
        """How the part has to lie for a grasp."""
        poses = self._objects_by_name[grasp.object_name].poses
        return next(pose for pose in poses if pose.index == grasp.stable_pose)

    def to_json(self) -> str:
        """As text that [from_json][collection.plan.records.Plan.from_json] reads back exactly."""
        return self.model_dump_json()

    @classmethod
    def from_json(cls, text: str) -> Plan:
        """Read a plan.

        Raises:
            PlanError: the text is not a plan.
        """
        try:
            return cls.model_validate_json(text)
        except ValidationError as error:
            first = error.errors()[0]
            where = ".".join(map(str, first["loc"])) or "content"
            raise PlanError(f"not a plan: {where}: {first['msg']}") from error
