"""The trial table's columns: one place for name, type, unit and meaning.

Parquet's schema, the CSV file, the Croissant description and the card's column list all come
from here. Matrices are row-major lists.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from logs.dataset.labeled_trial import Execution, Label, LabeledTrial, StoredScore
from reach.arrays import FloatArray

Kind = Literal["text", "integer", "number", "truth", "numbers", "texts"]


@dataclass(frozen=True, slots=True)
class Column:
    """One column of the trial table.

    Args:
        name: as it stands in the files.
        kind: text, integer, number, truth (bool), numbers or texts (lists).
        meaning: one sentence.
        value: takes it from a trial.
        unit: SI unit; empty for none.
        nullable: may be missing.
    """

    name: str
    kind: Kind
    meaning: str
    value: Callable[[LabeledTrial], Any]
    unit: str = ""
    nullable: bool = False


def _flat(matrix: FloatArray | None) -> list[float] | None:
    flat: list[float] | None = None if matrix is None else matrix.ravel().tolist()
    return flat


BASE_COLUMNS: tuple[Column, ...] = (
    Column("trial_id", "text", "unique id of the trial", lambda t: t.trial_id),
    Column(
        "session",
        "text",
        "folder name of the session, or source, the trial is from",
        lambda t: t.session,
    ),
    Column(
        "segment",
        "integer",
        "part of the session; grows with each accepted change of the station's set-up",
        lambda t: t.segment,
    ),
    Column("number", "integer", "place in the planned order, from 1", lambda t: t.number),
    Column("simulated", "truth", "true: no real robot moved", lambda t: t.simulated),
    Column("object", "text", "name of the object; its mesh is in meshes/", lambda t: t.object_name),
    Column("grasp_id", "text", "planned grasp; its repeats share it", lambda t: t.grasp_id),
    Column(
        "attempt", "integer", "index of the grasp among the object's, from 0", lambda t: t.attempt
    ),
    Column("repeat", "integer", "which repeat of the grasp, from 0", lambda t: t.repeat),
    Column("stable_pose", "integer", "index of the declared stable pose", lambda t: t.stable_pose),
    Column("success", "truth", "the label: stably lifted", lambda t: t.label.success),
    Column("rotated", "truth", "turned in the grasp; still a success", lambda t: t.label.rotated),
    Column("failure_reason", "text", "why it failed", lambda t: t.label.reason, nullable=True),
    Column("operator", "text", "who labeled", lambda t: t.label.operator),
    Column(
        "label_source",
        "text",
        "operator, operator_sim (simulated) or published",
        lambda t: t.label.source,
    ),
    Column("note", "text", "the operator's remark", lambda t: t.label.note),
    Column("blind", "truth", "labeled without having seen a prediction", lambda t: t.label.blind),
    Column(
        "label_time_ns",
        "integer",
        "when it was labeled, since the epoch",
        lambda t: t.label.time_ns,
        "ns",
        nullable=True,
    ),
    Column("relabeled", "integer", "earlier labels it replaces", lambda t: t.label.relabeled),
    Column("takes", "integer", "takes begun for this trial", lambda t: t.takes),
    Column("redo_causes", "texts", "why earlier takes were redone", lambda t: list(t.redos)),
    Column(
        "redo_outcomes",
        "texts",
        "what the sensors said of each redone take: lifted, not lifted or unknown",
        lambda t: list(t.redo_outcomes),
    ),
    Column("void_causes", "texts", "why earlier takes were void", lambda t: list(t.voids)),
    Column(
        "T_world_object_planned",
        "numbers",
        "planned pose of the object, 4x4 row-major",
        lambda t: _flat(t.T_world_object),
        "m",
    ),
    Column(
        "T_object_gripper_planned",
        "numbers",
        "planned grasp: pose of the gripper in the object's frame, 4x4 row-major",
        lambda t: _flat(t.T_object_gripper),
        "m",
    ),
    Column("table_height", "number", "world z of the table", lambda t: t.table_height, "m"),
    Column(
        "opening",
        "number",
        "distance of the pads before closing; fully open if missing",
        lambda t: t.opening,
        "m",
        nullable=True,
    ),
    Column("closing_force", "number", "closing force of each jaw", lambda t: t.force, "N"),
    Column(
        "T_world_object_registered",
        "numbers",
        "registered pose of the object, 4x4 row-major",
        lambda t: _flat(t.execution.T_world_object),
        "m",
        nullable=True,
    ),
    Column(
        "registration_covariance",
        "numbers",
        "of the registered pose relative to the camera, 6x6 row-major, (rotation, translation), "
        "right perturbation in the object's frame, as registration states it: without the errors "
        "of calibration and hand",
        lambda t: _flat(t.execution.covariance),
        "rad, m",
        nullable=True,
    ),
    Column(
        "object_in_hand_covariance",
        "numbers",
        "of the object's pose relative to the gripper, 6x6 row-major, (rotation, translation), "
        "right perturbation in the object's frame: registration_covariance with calibration and "
        "actuation as the station states them, which are common to the trials of a segment",
        lambda t: _flat(t.execution.covariance_in_hand),
        "rad, m",
        nullable=True,
    ),
    Column(
        "T_world_gripper_executed",
        "numbers",
        "measured pose of the gripper with the jaws closed, 4x4 row-major",
        lambda t: _flat(t.execution.T_world_gripper),
        "m",
        nullable=True,
    ),
    Column(
        "T_object_gripper_executed",
        "numbers",
        "the grasp as executed on the registered object, 4x4 row-major",
        lambda t: _flat(t.execution.T_object_gripper),
        "m",
        nullable=True,
    ),
    Column(
        "registration_rotation_error",
        "number",
        "true error of the registered pose up to symmetry, known of a simulation only",
        lambda t: t.execution.rotation_error,
        "rad",
        nullable=True,
    ),
    Column(
        "registration_translation_error",
        "number",
        "true error of the registered pose up to symmetry, known of a simulation only",
        lambda t: t.execution.translation_error,
        "m",
        nullable=True,
    ),
    Column(
        "jaw_width",
        "number",
        "between the pads at the end of the hold",
        lambda t: t.execution.jaw_width,
        "m",
        nullable=True,
    ),
    Column(
        "jaw_force",
        "number",
        "measured closing force",
        lambda t: t.execution.jaw_force,
        "N",
        nullable=True,
    ),
    Column(
        "sensor_verdict",
        "text",
        "what the gripper's own sensors say; never the label",
        lambda t: t.execution.sensor_verdict,
        nullable=True,
    ),
    Column(
        "executed_time_ns",
        "integer",
        "when the jaws had closed, since the epoch",
        lambda t: t.execution.time_ns,
        "ns",
        nullable=True,
    ),
    Column(
        "record",
        "text",
        "path of the MCAP record in the session's folder",
        lambda t: t.record,
        nullable=True,
    ),
    Column("record_sha256", "text", "of the record", lambda t: t.record_sha256, nullable=True),
)


def columns(models: Iterable[str]) -> tuple[Column, ...]:
    """All columns: the fixed ones, then score, version and parameters of each model."""
    scored = [column for model in sorted(models) for column in _score_columns(model)]
    return (*BASE_COLUMNS, *scored)


def _score_columns(model: str) -> tuple[Column, Column, Column]:
    def parameters(trial: LabeledTrial) -> str | None:
        score = trial.scores.get(model)
        return None if score is None else json.dumps(dict(score.parameters), sort_keys=True)

    def part(name: str) -> Callable[[LabeledTrial], Any]:
        return lambda trial: getattr(trial.scores.get(model), name, None)

    return (
        Column(
            f"score_{model}",
            "number",
            f"score of {model}, 0 to 1: of the planned grasp on the registered pose, as stored with "
            "the trial; `reach evaluate` scores the planned pose anew",
            part("value"),
            nullable=True,
        ),
        Column(
            f"score_{model}_version", "text", f"version of {model}", part("version"), nullable=True
        ),
        Column(
            f"score_{model}_parameters",
            "text",
            f"parameters of {model}, JSON",
            parameters,
            nullable=True,
        ),
    )


def scored_models(trials: Iterable[LabeledTrial]) -> tuple[str, ...]:
    """Names of all models that scored any of the trials."""
    return tuple(sorted({model for trial in trials for model in trial.scores}))


def trial_of_row(row: dict[str, Any], models: Iterable[str]) -> LabeledTrial:
    """The trial that a row of the table describes: the inverse of the columns' values."""
    label = Label(
        success=row["success"],
        rotated=row["rotated"],
        reason=row["failure_reason"],
        operator=row["operator"],
        source=row["label_source"],
        note=row["note"],
        blind=row["blind"],
        time_ns=row["label_time_ns"],
        relabeled=row["relabeled"],
    )
    execution = Execution(
        T_world_object=_matrix(row["T_world_object_registered"], 4),
        covariance=_matrix(row["registration_covariance"], 6),
        covariance_in_hand=_matrix(row.get("object_in_hand_covariance"), 6),  # younger than v1
        T_world_gripper=_matrix(row["T_world_gripper_executed"], 4),
        T_object_gripper=_matrix(row["T_object_gripper_executed"], 4),
        jaw_width=row["jaw_width"],
        jaw_force=row["jaw_force"],
        sensor_verdict=row["sensor_verdict"],
        time_ns=row["executed_time_ns"],
        rotation_error=row["registration_rotation_error"],
        translation_error=row["registration_translation_error"],
    )
    return LabeledTrial(
        trial_id=row["trial_id"],
        session=row["session"],
        segment=row["segment"],
        number=row["number"],
        object_name=row["object"],
        grasp_id=row["grasp_id"],
        attempt=row["attempt"],
        repeat=row["repeat"],
        stable_pose=row["stable_pose"],
        T_world_object=np.reshape(row["T_world_object_planned"], (4, 4)),
        T_object_gripper=np.reshape(row["T_object_gripper_planned"], (4, 4)),
        table_height=row["table_height"],
        opening=row["opening"],
        force=row["closing_force"],
        label=label,
        execution=execution,
        scores={m: _score(row, m) for m in models if row[f"score_{m}"] is not None},
        takes=row["takes"],
        redos=tuple(row["redo_causes"]),
        redo_outcomes=tuple(row["redo_outcomes"]),
        voids=tuple(row["void_causes"]),
        record=row["record"],
        record_sha256=row["record_sha256"],
        simulated=row["simulated"],
    )


def _matrix(flat: list[float] | None, size: int) -> FloatArray | None:
    return None if flat is None else np.reshape(np.asarray(flat, dtype=float), (size, size))


def _score(row: dict[str, Any], model: str) -> StoredScore:
    parameters = json.loads(row[f"score_{model}_parameters"] or "{}")
    return StoredScore(row[f"score_{model}"], row[f"score_{model}_version"] or "", parameters)
