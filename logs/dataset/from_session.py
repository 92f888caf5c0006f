"""A data set from a recorded session: the journal says what counts, the records what was done."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

from logs.dataset.dataset import Dataset
from logs.dataset.labeled_trial import Execution, Label, LabeledTrial, LeftOut, StoredScore
from logs.dataset.station_error import (
    StationError,
    session_pose_error,
    station_error,
    table_height,
)
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
    "labelled": "labeled, but its record is missing or damaged",
}


def session_dataset(path: Path, *, unblinded: bool = False) -> Dataset:
    """Read the labeled trials of a session; it may be running.

    Args:
        path: the session's folder.
        unblinded: use the newest verdict even if it was given after a prediction had been seen;
            otherwise the newest blind one counts where there is any.

    Raises:
        NotASessionError: no session folder.
        UnknownFormatError: a later release wrote a record.
        DatasetError: one object name with two geometries.
    """
    folder = SessionFolder.open(path)
    state = folder.read_state()
    name = path.resolve().name
    labeled = [trial for trial in state.order if trial.status == "labelled"]
    found = zip(labeled, read_facts([_record_path(path, one) for one in labeled]), strict=True)
    read = {trial.trial_id: one for trial, one in found if one is not None}
    counted = [trial for trial in labeled if trial.trial_id in read]
    facts = list(read.values())
    attempts = _attempts(state.order)
    table, station = table_height(folder), station_error(folder)
    trials = tuple(
        _labeled_trial(
            trial, one, name, attempts[trial.planned.grasp_id], table, station, unblinded
        )
        for trial, one in zip(counted, facts, strict=True)
    )
    return Dataset(
        name=name,
        origin=_origin(folder),
        objects=_objects(facts),
        mass_sources={one.descriptor.object_name: "stated in the session" for one in facts},
        gripper=_gripper(facts),
        trials=trials,
        left_out=tuple(_left_out(t, name) for t in state.order if t.trial_id not in read),
        pose_error=session_pose_error(trials, station),
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
    height: float,
    station: StationError | None,
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
        T_world_object=make_transform(None, (0, 0, height)) @ described.T_world_object,
        T_object_gripper=described.planned.T_object_gripper,
        table_height=height,
        opening=described.planned.opening,
        force=described.planned.force,
        label=_label(take, unblinded),
        execution=_execution(take, facts, station),
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


def _execution(take: TakeState, facts: RecordFacts, station: StationError | None) -> Execution:
    found, done = facts.registration, facts.execution
    covariance = None if found is None else found.covariance
    width = take.sensor.jaw_width if take.sensor else None
    measured: Mapping[str, float] = done.measurements if done else {}
    return Execution(
        T_world_object=None if found is None else found.T_world_object,
        covariance=covariance,
        covariance_in_hand=(
            None if covariance is None or station is None else station.beside(covariance)
        ),
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
