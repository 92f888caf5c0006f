"""The physical data of 2019: reading its JSON, and writing the same form.

One JSON list of records per object. `pose` is T_world_object, `grasp` T_world_gripper, both as
planned, so that T_object_gripper = inverse(pose) @ grasp; the table is at the lowest vertex of the
posed mesh. Published rotations are orthonormal to about 0.01 only: they are projected to the
nearest rotation, and the original record is kept word for word. What `tf` means is not documented
for the published data; nothing is computed from it.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from pydantic import (
    BaseModel,
    ConfigDict,
    Field,
    FiniteFloat,
    StrictBool,
    StrictInt,
    ValidationError,
)

from logs.dataset.dataset import Dataset
from logs.dataset.labeled_trial import LabeledTrial
from logs.errors import DatasetError
from reach.arrays import FloatArray
from reach.transforms import inverse, project_to_rotation

ROTATION_TOLERANCE = 0.02
"""How far R^T R may be off the identity before a rotation is refused."""

FARTHEST = 1.0
"""How far a hand that grasps an object may be from it [m]: farther is another unit."""

Row = tuple[FiniteFloat, FiniteFloat, FiniteFloat, FiniteFloat]
Matrix = tuple[Row, Row, Row, Row]


class Record(BaseModel):
    """One trial as published; further keys are kept but not used."""

    model_config = ConfigDict(extra="allow", frozen=True)

    obj: str = Field(min_length=1)
    pose: Matrix
    grasp: Matrix
    result: StrictBool
    stable_pose: StrictInt
    attempt: StrictInt = Field(ge=0)
    trial: StrictInt = Field(ge=0)
    tf: Matrix | None = None
    qs_cons: StrictBool | None = None
    qs_agg: StrictBool | None = None
    qs_orig: StrictBool | None = None


@dataclass(frozen=True, slots=True, eq=False)
class ReadRecord:
    """A checked record.

    Args:
        record: its content.
        T_world_object: projected pose, shape (4, 4).
        T_object_gripper: shape (4, 4).
        deviation: the larger distance of its two rotations from orthonormal.
        text: the original as JSON text.
    """

    record: Record
    T_world_object: FloatArray
    T_object_gripper: FloatArray
    deviation: float
    text: str


def read_records(path: Path) -> list[ReadRecord]:
    """Read one published file.

    Raises:
        DatasetError: unreadable, no list, or a record that does not fit, with its number.
    """
    try:
        content = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, UnicodeDecodeError, ValueError) as error:
        raise DatasetError(f"cannot read {path}: {error}") from error
    if not isinstance(content, list) or not content:
        raise DatasetError(f"{path} holds no list of records; expected [{{'obj': ..., ...}}, ...]")
    records: list[ReadRecord] = []
    seen: dict[tuple[str, int, int], int] = {}
    for number, item in enumerate(content):
        one = _check(item, f"{path}: record {number}")
        key = (one.record.obj, one.record.attempt, one.record.trial)
        if key in seen:
            raise DatasetError(
                f"{path}: record {number} repeats record {seen[key]}: object {key[0]!r}, attempt "
                f"{key[1]}, trial {key[2]}"
            )
        seen[key] = number
        records.append(one)
    return records


def _check(item: Any, where: str) -> ReadRecord:
    try:
        record = Record.model_validate(item)
    except ValidationError as error:
        first = error.errors()[0]
        place = ".".join(map(str, first["loc"])) or "record"
        raise DatasetError(f"{where}: {place}: {first['msg']}") from error
    T_world_object, pose_off = _rigid(record.pose, f"{where}: pose")
    T_world_gripper, grasp_off = _rigid(record.grasp, f"{where}: grasp")
    T_object_gripper = inverse(T_world_object) @ T_world_gripper
    distance = float(np.linalg.norm(T_object_gripper[:3, 3]))
    if distance > FARTHEST:
        raise DatasetError(
            f"{where}: the hand is {distance:.3g} m from the object, expected at most {FARTHEST:g} m; "
            "lengths are meters"
        )
    return ReadRecord(
        record,
        T_world_object,
        T_object_gripper,
        max(pose_off, grasp_off),
        _as_text(item, where),
    )


def _as_text(item: Any, where: str) -> str:
    try:
        return json.dumps(item, allow_nan=False)
    except ValueError as error:
        raise DatasetError(f"{where} holds a value that is not finite") from error


def _rigid(matrix: Matrix, where: str) -> tuple[FloatArray, float]:
    """The nearest rigid transform, and how far the rotation was off orthonormal."""
    T = np.array(matrix, dtype=float)
    if not np.array_equal(T[3], [0.0, 0.0, 0.0, 1.0]):
        raise DatasetError(f"{where} has the last row {T[3].tolist()}, expected [0, 0, 0, 1]")
    rotation = T[:3, :3]
    deviation = float(np.abs(rotation.T @ rotation - np.eye(3)).max())
    if deviation > ROTATION_TOLERANCE:
        raise DatasetError(
            f"{where} has a rotation {deviation:.3g} off orthonormal; up to {ROTATION_TOLERANCE} "
            "is projected"
        )
    if np.linalg.det(rotation) < 0:
        raise DatasetError(f"{where} mirrors: its rotation has determinant -1")
    T[:3, :3] = project_to_rotation(rotation)
    return T, deviation


def reach2019_files(dataset: Dataset, stems: Mapping[str, str]) -> dict[str, bytes]:
    """The data set in the published form, one file an object, by path.

    An imported trial is written as it was read. For others, `tf` is the transform in the world
    that carries the planned to the registered pose (the identity if nothing was registered), and
    the published models' predictions (`qs_*`) are absent.
    """
    return {
        f"reach2019/{stems[name]}.json": (
            json.dumps([_record(trial) for trial in _in_published_order(trials)], indent=1)
        ).encode()
        for name, trials in dataset.by_object().items()
    }


def _in_published_order(trials: Sequence[LabeledTrial]) -> list[LabeledTrial]:
    """Imported trials in the order they were read, others by attempt and repeat."""
    if all(trial.source_record is not None for trial in trials):
        return sorted(trials, key=lambda trial: trial.number)
    return sorted(trials, key=lambda t: (t.attempt, t.repeat, t.session, t.number))


def _record(trial: LabeledTrial) -> Any:
    if trial.source_record is not None:
        return json.loads(trial.source_record)
    registered = trial.execution.T_world_object
    tf = np.eye(4) if registered is None else registered @ inverse(trial.T_world_object)
    return {
        "obj": trial.object_name,
        "pose": trial.T_world_object.tolist(),
        "grasp": (trial.T_world_object @ trial.T_object_gripper).tolist(),
        "tf": tf.tolist(),
        "result": trial.label.success,
        "stable_pose": trial.stable_pose,
        "attempt": trial.attempt,
        "trial": trial.repeat,
        "simulated": trial.simulated,
    }
