"""One trial that counts: what was planned, what was done, how it ended, and how it was scored."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from reach.arrays import FloatArray, frozen
from reach.errors import InvalidInputError
from reach.transforms import as_transform

Parameter = float | bool | str


@dataclass(frozen=True, slots=True)
class Label:
    """The verdict that counts for a trial.

    Args:
        success: stably lifted.
        rotated: turned in the grasp; still a success.
        reason: why it failed, None for a success or where nobody said.
        operator: who decided.
        source: `operator`, `operator_sim` (simulated) or `published`.
        note: the operator's remark.
        blind: decided without having seen a prediction.
        time_ns: when, nanoseconds since the epoch; None if unknown.
        relabeled: how many earlier verdicts it replaces.
    """

    success: bool
    rotated: bool = False
    reason: str | None = None
    operator: str = ""
    source: str = "operator"
    note: str = ""
    blind: bool = True
    time_ns: int | None = None
    relabeled: int = 0


@dataclass(frozen=True, slots=True, eq=False)
class Execution:
    """What registration found and the robot did; fields the source does not tell are None.

    Args:
        T_world_object: registered pose, shape (4, 4).
        covariance: of it, shape (6, 6), (rotation [rad], translation [m]), object frame; a
            turn about an axis of symmetry has the variance of a full turn.
        covariance_in_hand: of the object's pose relative to the gripper, shape (6, 6), object frame:
            `covariance` with the station's stated errors of calibration and actuation, which all
            trials under one set-up share; None where the station states none.
        T_world_gripper: measured when the jaws had closed, shape (4, 4).
        T_object_gripper: the grasp as executed on the registered object, shape (4, 4).
        jaw_width: between the pads at the end of the hold [m].
        jaw_force: measured closing force [N].
        sensor_verdict: what the gripper's own sensors say.
        time_ns: when the jaws had closed, nanoseconds since the epoch.
        rotation_error: true error of the registered pose [rad], known of a simulation only.
        translation_error: the same [m].
    """

    T_world_object: FloatArray | None = None
    covariance: FloatArray | None = None
    covariance_in_hand: FloatArray | None = None
    T_world_gripper: FloatArray | None = None
    T_object_gripper: FloatArray | None = None
    jaw_width: float | None = None
    jaw_force: float | None = None
    sensor_verdict: str | None = None
    time_ns: int | None = None
    rotation_error: float | None = None
    translation_error: float | None = None

    def __post_init__(self) -> None:
        for name in ("T_world_object", "T_world_gripper", "T_object_gripper"):
            value = getattr(self, name)
            if value is not None:
                object.__setattr__(self, name, as_transform(value, name))
        for name in ("covariance", "covariance_in_hand"):
            value = getattr(self, name)
            if value is not None:
                object.__setattr__(self, name, _covariance(value))


def _covariance(value: FloatArray) -> FloatArray:
    covariance = frozen(value)
    if covariance.shape != (6, 6) or not np.isfinite(covariance).all():
        raise InvalidInputError(
            f"pose covariance has shape {covariance.shape}, expected (6, 6) finite numbers"
        )
    return covariance


@dataclass(frozen=True, slots=True)
class StoredScore:
    """A model's score of a trial, as it was recorded."""

    value: float
    version: str = ""
    parameters: Mapping[str, Parameter] = field(default_factory=dict)


@dataclass(frozen=True, slots=True, eq=False)
class LabeledTrial:
    """One trial that counts.

    Args:
        trial_id: unique.
        session: identity of its session or source.
        segment: of that session; grows with each accepted change of the station's set-up.
        number: place in the planned order.
        object_name: key of the data set's objects.
        grasp_id: of the planned grasp; its repeats share it.
        attempt: index of the grasp among the object's, from 0.
        repeat: which repeat of the grasp, from 0.
        stable_pose: index of the declared stable pose.
        T_world_object: planned pose of the object, shape (4, 4).
        T_object_gripper: planned grasp, shape (4, 4).
        table_height: world z of the table under the planned pose [m].
        opening: of the jaws before closing [m]; fully open if None.
        force: closing force [N].
        label: the verdict that counts.
        execution: what really happened.
        scores: model -> score as recorded.
        takes: how often it was executed or begun; 1 without redo or void.
        redos: why takes were redone, in order.
        redo_outcomes: what the sensors said of each redone take: lifted, not lifted or unknown.
        voids: why takes were void, in order.
        record: path of its record, relative to the session; None if there is none.
        record_sha256: of that file.
        simulated: no real robot moved.
        source_record: the imported record as JSON text, for an exact round trip.
    """

    trial_id: str
    session: str
    number: int
    object_name: str
    grasp_id: str
    attempt: int
    repeat: int
    stable_pose: int
    T_world_object: FloatArray
    T_object_gripper: FloatArray
    table_height: float
    opening: float | None
    force: float
    label: Label
    execution: Execution = field(default_factory=Execution)
    scores: Mapping[str, StoredScore] = field(default_factory=dict)
    takes: int = 1
    redos: tuple[str, ...] = ()
    redo_outcomes: tuple[str, ...] = ()
    voids: tuple[str, ...] = ()
    record: str | None = None
    record_sha256: str | None = None
    simulated: bool = False
    segment: int = 0
    source_record: str | None = None

    def __post_init__(self) -> None:
        for name in ("T_world_object", "T_object_gripper"):
            object.__setattr__(self, name, as_transform(getattr(self, name), name))


@dataclass(frozen=True, slots=True)
class LeftOut:
    """A planned trial that does not count, and why."""

    trial_id: str
    session: str
    number: int
    object_name: str
    grasp_id: str
    reason: str
