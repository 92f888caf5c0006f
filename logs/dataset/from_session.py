"""A data set from a recorded session: the journal says what counts, the records what was done."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path

import numpy as np

from logs.dataset.dataset import Dataset, StatedPoseError
from logs.dataset.labeled_trial import Execution, Label, LabeledTrial, LeftOut, StoredScore
from logs.dataset.registration_residual import claimed_variances
from logs.errors import DatasetError
from logs.journal.events import LabelEvent, Outcome, Scored
from logs.journal.state import TakeState, TrialState
from logs.record.facts import RecordFacts, read_facts
from logs.session.folder import SessionFolder
from reach.gripper import ParallelJawGripper
from reach.objects import GraspObject
from reach.transforms import make_transform

_LEFT_OUT = {
    "unlabelled": "executed, not labeled",
    "pending": "not executed",
    "running": "not finished",
    "skipped": "skipped",
}


def session_dataset(path: Path, *, unblinded: bool = False) -> Dataset:
    """Read the labeled trials of a session; it may be running.

    Args:
        path: the session's folder.
        unblinded: use the newest verdict even if it was given after a prediction had been seen;
            otherwise the newest blind one counts where there is any.

    Raises:
        NotASessionError: no session folder.
        RecordReadError: a labeled trial's record cannot be read.
        DatasetError: one object name with two geometries.
    """
    folder = SessionFolder.open(path)
    state = folder.read_state()
    name = path.resolve().name
    counted = [trial for trial in state.order if trial.status == "labelled"]
    facts = read_facts([_record_path(path, trial) for trial in counted])
    attempts, table = _attempts(state.order), _table_height(folder)
    trials = tuple(
        _labeled_trial(trial, one, name, attempts[trial.planned.grasp_id], table, unblinded)
        for trial, one in zip(counted, facts, strict=True)
    )
    return Dataset(
        name=name,
        origin=_origin(folder),
        objects=_objects(facts),
        mass_sources={one.descriptor.object_name: "stated in the session" for one in facts},
        gripper=_gripper(facts),
        trials=trials,
        left_out=tuple(_left_out(t, name) for t in state.order if t.status != "labelled"),
        pose_error=_pose_error(trials, _station_error(folder)),
        notes=_notes(counted, unblinded),
    )


def _record_path(session: Path, trial: TrialState) -> Path:
    take = trial.valid_take
    if take is None or take.record is None:
        raise DatasetError(f"trial {trial.trial_id} of {session} is labeled but has no record")
    return session / take.record


def _origin(folder: SessionFolder) -> str:
    described = folder.descriptor
    station = "simulated" if described.simulated else "real"
    return (
        f"Recorded on a {station} station, session {described.session_id}, seed {described.seed}."
    )


def _attempts(trials: Sequence[TrialState]) -> dict[str, int]:
    """Index of each planned grasp among its object's."""
    grasps: dict[str, set[str]] = {}
    for trial in trials:
        grasps.setdefault(trial.planned.object_name, set()).add(trial.planned.grasp_id)
    return {grasp: i for ids in grasps.values() for i, grasp in enumerate(sorted(ids))}


def _objects(facts: Sequence[RecordFacts]) -> dict[str, GraspObject]:
    objects: dict[str, GraspObject] = {}
    for one in facts:
        described = one.descriptor
        known = objects.get(described.object_name)
        if known is None:
            vertices, faces = one.mesh
            known = GraspObject(
                described.object_name,
                vertices,
                faces,
                described.object_mass,
                described.center_of_mass,
            )
            objects[described.object_name] = known
        if known.content_hash != described.object_hash:
            raise DatasetError(
                f"object {described.object_name!r} has another shape in {one.path} than before"
            )
    return objects


def _gripper(facts: Sequence[RecordFacts]) -> ParallelJawGripper:
    return facts[0].gripper if facts else ParallelJawGripper.yumi()


def _labeled_trial(
    trial: TrialState,
    facts: RecordFacts,
    session: str,
    attempt: int,
    table_height: float,
    unblinded: bool,
) -> LabeledTrial:
    """One row; a plan's poses rest on a table at zero and are lifted to the station's."""
    planned, described = trial.planned, facts.descriptor
    take = trial.valid_take
    assert take is not None
    redone = [take for take in trial.takes if take.status == "redone"]
    return LabeledTrial(
        trial_id=trial.trial_id,
        session=session,
        number=planned.number,
        object_name=planned.object_name,
        grasp_id=planned.grasp_id,
        attempt=attempt,
        repeat=planned.repeat,
        stable_pose=described.stable_pose,
        T_world_object=make_transform(None, (0, 0, table_height)) @ described.T_world_object,
        T_object_gripper=described.planned.T_object_gripper,
        table_height=table_height,
        opening=described.planned.opening,
        force=described.planned.force,
        label=_label(take, unblinded),
        execution=_execution(take, facts),
        scores={model: _score(event) for model, event in sorted(take.scores.items())},
        takes=len(trial.takes),
        redos=tuple(t.ended_because for t in redone),
        redo_outcomes=tuple(_sensed(t) for t in redone),
        voids=tuple(
            _short(t.ended_because) for t in trial.takes if t.status in ("voided", "interrupted")
        ),
        record=take.record,
        record_sha256=facts.sha256,
        simulated=described.simulated,
        segment=take.segment,
    )


def _sensed(take: TakeState) -> str:
    lifted = take.sensor.lifted if take.sensor else None
    return {True: "lifted", False: "not lifted", None: "unknown"}[lifted]


def _chosen_label(take: TakeState, unblinded: bool) -> LabelEvent:
    label = take.label if unblinded else take.blind_label or take.label
    assert label is not None
    return label


def _label(take: TakeState, unblinded: bool) -> Label:
    chosen = _chosen_label(take, unblinded)
    position, entry = next(
        (i, entry) for i, (entry, label) in enumerate(take.labels) if label is chosen
    )
    return Label(
        success=chosen.outcome is Outcome.SUCCESS,
        rotated=chosen.rotated,
        reason=None if chosen.reason is None else chosen.reason.value,
        operator=chosen.operator,
        source=chosen.source.value,
        note=chosen.note,
        blind=chosen.blind,
        time_ns=entry.time_ns,
        relabeled=position,
    )


def _execution(take: TakeState, facts: RecordFacts) -> Execution:
    found, done = facts.registration, facts.execution
    width = take.sensor.jaw_width if take.sensor else None
    measured: Mapping[str, float] = done.measurements if done else {}
    return Execution(
        T_world_object=None if found is None else found.T_world_object,
        covariance=None if found is None else found.covariance,
        T_world_gripper=None if done is None else done.T_world_gripper,
        T_object_gripper=None if done is None else done.executed.T_object_gripper,
        jaw_width=width if width is not None else measured.get("width"),
        jaw_force=measured.get("force"),
        sensor_verdict=None if done is None else done.sensor_verdict,
        time_ns=take.executed_ns if done is None else done.time_ns,
        rotation_error=measured.get("true_registration_error_rotation"),
        translation_error=measured.get("true_registration_error_translation"),
    )


def _score(event: Scored) -> StoredScore:
    parameters = event.details.get("parameters", {})
    known = parameters if isinstance(parameters, dict) else {}
    plain = {k: v for k, v in known.items() if isinstance(v, bool | int | float | str)}
    return StoredScore(event.value, event.version, plain)


def _short(cause: str) -> str:
    """The kind of a cause, without the numbers of the single case."""
    return cause.split(":")[0].strip() or "unknown"


def _left_out(trial: TrialState, session: str) -> LeftOut:
    planned = trial.planned
    reason = trial.needs_label or _LEFT_OUT.get(trial.status, trial.status)
    if trial.status == "pending" and trial.takes:
        reason = f"void, not taken again ({_short(trial.takes[-1].ended_because)})"
    return LeftOut(
        trial.trial_id, session, planned.number, planned.object_name, planned.grasp_id, reason
    )


def _station_section(folder: SessionFolder, name: str) -> dict[str, float]:
    """The numbers in a section of the station file; empty if there is no such section."""
    station = folder.descriptor.config.get("station")
    section = station.get(name) if isinstance(station, dict) else None
    items = section.items() if isinstance(section, dict) else ()
    return {key: float(value) for key, value in items if isinstance(value, int | float)}


def _table_height(folder: SessionFolder) -> float:
    """World z of the station's table [m]; zero where no station file says otherwise."""
    return _station_section(folder, "workspace").get("table_height", 0.0)


def _station_error(folder: SessionFolder) -> tuple[float, float, str] | None:
    """Variances of translation [m^2] and rotation [rad^2] that are known of a station, and whence.

    Its section `pose_error` holds standard deviations named by cause: calibration, actuation.
    """
    numbers = _station_section(folder, "pose_error")
    source = _pose_error_source(folder)
    if not numbers or source == "unknown":
        return None
    translation = sum(v * v for key, v in numbers.items() if key.endswith("_translation"))
    rotation = sum(v * v for key, v in numbers.items() if key.endswith("_rotation"))
    whence = "calibration and actuation as the station file states them"
    if source == "calibration":
        whence = "the calibration's residuals (actuation is not stated)"
    return translation, rotation, whence


def _pose_error_source(folder: SessionFolder) -> str:
    """Who says how large the station's errors are; sessions before this was kept: the file."""
    station = folder.descriptor.config.get("station")
    section = station.get("pose_error") if isinstance(station, dict) else None
    return str(section.get("source", "stated")) if isinstance(section, dict) else "unknown"


def _pose_error(
    trials: Iterable[LabeledTrial], station: tuple[float, float, str] | None
) -> StatedPoseError | None:
    """Root mean square of the registrations' own deviations, and the station's beside them.

    Args:
        trials: those that count.
        station: variances of calibration and actuation together, and whence; None if not stated.
    """
    claimed = claimed_variances(trials)
    if claimed is None:
        return None
    variances, count = claimed
    translation, rotation = variances[3:].mean(), variances[:3].mean()
    basis = f"root mean square of {count} registrations' stated covariances"
    if station is not None:
        translation, rotation = translation + station[0], rotation + station[1]
        basis += f", and {station[2]}"
    else:
        basis += "; calibration and actuation not stated, and not included"
    return StatedPoseError(_stated(translation), _stated(rotation), basis)


def _stated(variance: float) -> float:
    """Standard deviation to two digits: more are noise, and every new trial would change them.

    Cached scores hold under one pose error; a session that goes on keeps them.
    """
    return float(f"{np.sqrt(variance):.1e}")


def _notes(trials: Sequence[TrialState], unblinded: bool) -> tuple[str, ...]:
    replaced = sum(
        take is not None and take.label is not _chosen_label(take, unblinded)
        for take in (trial.valid_take for trial in trials)
    )
    if not replaced:
        return ()
    return (
        f"{replaced} relabels were given after a prediction had been seen; the blind label counts.",
    )
