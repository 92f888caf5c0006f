"""What a trial's record says: start, descriptor, events, results, stop.

These types are the record's vocabulary; [collection][] maps what registration and the robot
return into them, and readers of every format version return them. Measured streams (images,
tracks of joints and transforms) are in [logs.record.streams][].
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import StrEnum

import numpy as np

from reach.arrays import FloatArray, frozen, frozen_finite
from reach.errors import InvalidInputError
from reach.grasp import Grasp
from reach.transforms import as_transform

FORMAT_VERSION = 1
"""Version of the record format that this release writes."""


class ExitStatus(StrEnum):
    """How a trial ended: executed, stopped by a fault or a person, or killed half-way."""

    SUCCESS = "success"
    FAIL = "fail"
    ABORT = "abort"


class EventKind(StrEnum):
    """Where an event of a trial comes from."""

    PHASE = "phase"
    ROBOT = "robot"
    CAMERA = "camera"
    OPERATOR = "operator"
    GAP = "gap"
    NOTE = "note"


class Severity(StrEnum):
    """How much an event matters."""

    INFO = "info"
    WARNING = "warning"
    ERROR = "error"


@dataclass(frozen=True, slots=True, eq=False)
class TrialDescriptor:
    """Which trial this is and what is tried: what stands first in a record.

    Args:
        trial_id: uuid of the trial.
        session_id: of the session.
        number: in the session's planned order, from 1.
        object_name: how plans and tables call the object.
        object_hash: SHA-256 of its geometry.
        object_mass: [kg].
        center_of_mass: object frame, shape (3,) [m].
        stable_pose: index of the declared stable pose.
        T_world_object: where the planner expects the object, shape (4, 4).
        planned: the planned grasp.
        gripper_name: of the gripper.
        grasp_id: of the planned grasp; repeats share it.
        repeat: which repeat of the grasp, from 0.
        take: which attempt at this trial, from 1.
        seed: of everything random in this trial.
        simulated: no real robot moved.
        time_ns: when the trial started [ns].
        versions: of the software and its packages.
        metadata: whatever else the session wants to find here.
    """

    trial_id: str
    session_id: str
    number: int
    object_name: str
    object_hash: str
    object_mass: float
    center_of_mass: FloatArray
    stable_pose: int
    T_world_object: FloatArray
    planned: Grasp
    gripper_name: str
    grasp_id: str = ""
    repeat: int = 0
    take: int = 1
    seed: int = 0
    simulated: bool = False
    time_ns: int = 0
    versions: Mapping[str, str] = field(default_factory=dict)
    metadata: Mapping[str, str] = field(default_factory=dict)

    def __post_init__(self) -> None:
        set_field = object.__setattr__
        set_field(
            self, "center_of_mass", frozen_finite(self.center_of_mass, "center_of_mass", (3,))
        )
        set_field(self, "T_world_object", as_transform(self.T_world_object, "T_world_object"))


@dataclass(frozen=True, slots=True)
class TrialEvent:
    """Something that happened at an instant: a phase began, the robot reported, data is missing.

    Args:
        time_ns: when [ns].
        kind: where it comes from.
        name: short, for machines: `approach`, `jaw_force_lost`.
        message: for people.
        severity: how much it matters.
        data: details by name.
    """

    time_ns: int
    kind: EventKind
    name: str
    message: str = ""
    severity: Severity = Severity.INFO
    data: Mapping[str, str] = field(default_factory=dict)


@dataclass(frozen=True, slots=True, eq=False)
class RivalRecord:
    """Another pose that explains the image nearly as well."""

    T_world_object: FloatArray
    stable_pose: int | None
    render_cost: float

    def __post_init__(self) -> None:
        object.__setattr__(
            self, "T_world_object", as_transform(self.T_world_object, "T_world_object")
        )


@dataclass(frozen=True, slots=True, eq=False)
class RegistrationRecord:
    """Where the object was found, how sure that is, and what else it could have been.

    Args:
        time_ns: of the image [ns].
        T_world_object: shape (4, 4).
        T_camera_object: shape (4, 4).
        covariance: shape (6, 6), (rotation [rad], translation [m]), object frame; a turn about
            an axis of symmetry has the variance of a full turn.
        stable_pose: index of the stable pose that was found, if any.
        ambiguous: a rival is too close to call.
        contradicts_declared: the image shows another stable pose than the plan.
        quality: numbers by name: fitness, rmse, overlaps, render cost, margin.
        rivals: best first.
        unobservable: names of the directions the image does not fix.
        seed: of the search.
        seconds: time of each step.
    """

    time_ns: int
    T_world_object: FloatArray
    T_camera_object: FloatArray
    covariance: FloatArray
    stable_pose: int | None = None
    ambiguous: bool = False
    contradicts_declared: bool = False
    quality: Mapping[str, float] = field(default_factory=dict)
    rivals: tuple[RivalRecord, ...] = ()
    unobservable: tuple[str, ...] = ()
    seed: int = 0
    seconds: Mapping[str, float] = field(default_factory=dict)

    def __post_init__(self) -> None:
        set_field = object.__setattr__
        set_field(self, "T_world_object", as_transform(self.T_world_object, "T_world_object"))
        set_field(self, "T_camera_object", as_transform(self.T_camera_object, "T_camera_object"))
        covariance = frozen(self.covariance)
        if covariance.shape != (6, 6) or not np.isfinite(covariance).all():
            raise InvalidInputError(
                f"pose covariance has shape {covariance.shape}, expected (6, 6) finite numbers"
            )
        set_field(self, "covariance", covariance)


@dataclass(frozen=True, slots=True, eq=False)
class ExecutionRecord:
    """What the robot really did, and what its sensors say came of it.

    Args:
        time_ns: when the jaws had closed [ns].
        T_world_gripper_commanded: shape (4, 4).
        T_world_gripper: measured when the jaws had closed, shape (4, 4).
        executed: the grasp as executed on the registered object.
        sensor_verdict: `held`, `empty`, `lost` or `unknown`; never the operator's label.
        measurements: numbers by name: width, force, rise, ...
        details: texts by name.
    """

    time_ns: int
    T_world_gripper_commanded: FloatArray
    T_world_gripper: FloatArray
    executed: Grasp
    sensor_verdict: str = "unknown"
    measurements: Mapping[str, float] = field(default_factory=dict)
    details: Mapping[str, str] = field(default_factory=dict)

    def __post_init__(self) -> None:
        for name in ("T_world_gripper_commanded", "T_world_gripper"):
            object.__setattr__(self, name, as_transform(getattr(self, name), name))


@dataclass(frozen=True, slots=True)
class AttachmentRecord:
    """A file inside the record: object mesh, robot and gripper description, station file."""

    name: str
    media_type: str
    data: bytes


@dataclass(frozen=True, slots=True)
class TrialStop:
    """How and why the trial ended; the last message of a record.

    Args:
        time_ns: when [ns].
        exit_status: success (executed to the end), fail or abort.
        reason: empty after a success.
        message_counts: number of messages by topic, this one excepted.
    """

    time_ns: int
    exit_status: ExitStatus
    reason: str = ""
    message_counts: Mapping[str, int] = field(default_factory=dict)


def gap_event(topic: str, missing: int, why: str, time_ns: int) -> TrialEvent:
    """The event that tells that measurements of a channel are missing."""
    return TrialEvent(
        time_ns,
        EventKind.GAP,
        "missing",
        f"{missing} on {topic}: {why}",
        Severity.WARNING,
        {"topic": topic, "missing": str(missing)},
    )
