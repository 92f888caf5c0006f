"""Records to messages of format 1. The inverse is [logs.record.decode_v1][]."""

from __future__ import annotations

import hashlib

from foxglove_schemas_protobuf.Log_pb2 import Log

from logs.record.records import (
    FORMAT_VERSION,
    AttachmentRecord,
    ExecutionRecord,
    RegistrationRecord,
    Severity,
    TrialDescriptor,
    TrialEvent,
    TrialStop,
)
from logs.record.stamps import timestamp
from logs.schema import trial_v1_pb2 as v1
from reach.arrays import FloatArray
from reach.grasp import Grasp

_LOG_LEVEL = {Severity.INFO: Log.INFO, Severity.WARNING: Log.WARNING, Severity.ERROR: Log.ERROR}


def flat(array: FloatArray) -> list[float]:
    """An array's numbers row by row."""
    numbers: list[float] = array.ravel().tolist()
    return numbers


def encode_grasp(grasp: Grasp) -> v1.Grasp:
    """A grasp, bit for bit."""
    return v1.Grasp(
        T_object_gripper=flat(grasp.T_object_gripper), opening=grasp.opening, force=grasp.force
    )


def encode_start(descriptor: TrialDescriptor) -> v1.TrialStart:
    """Which trial this is."""
    return v1.TrialStart(
        timestamp=timestamp(descriptor.time_ns),
        format_version=FORMAT_VERSION,
        trial_id=descriptor.trial_id,
        session_id=descriptor.session_id,
        number=descriptor.number,
        grasp_id=descriptor.grasp_id,
        repeat=descriptor.repeat,
        take=descriptor.take,
        seed=descriptor.seed,
        simulated=descriptor.simulated,
        versions=dict(descriptor.versions),
        metadata=dict(descriptor.metadata),
    )


def encode_descriptor(descriptor: TrialDescriptor) -> v1.TrialDescriptor:
    """What is tried."""
    return v1.TrialDescriptor(
        timestamp=timestamp(descriptor.time_ns),
        object_name=descriptor.object_name,
        object_hash=descriptor.object_hash,
        object_mass=descriptor.object_mass,
        center_of_mass=flat(descriptor.center_of_mass),
        stable_pose=descriptor.stable_pose,
        T_world_object=flat(descriptor.T_world_object),
        planned=encode_grasp(descriptor.planned),
        gripper_name=descriptor.gripper_name,
    )


def encode_event(event: TrialEvent) -> v1.TrialEvent:
    """An event of the trial."""
    return v1.TrialEvent(
        timestamp=timestamp(event.time_ns),
        kind=event.kind.value,
        name=event.name,
        message=event.message,
        severity=v1.TrialEvent.Severity.Value(event.severity.name),
        data=dict(event.data),
    )


def encode_event_log(event: TrialEvent) -> Log:
    """The same event as a line that viewers show; readers take the typed one."""
    text = f"{event.name}: {event.message}" if event.message else event.name
    return log_line(event.time_ns, event.kind.value, text, event.severity)


def log_line(time_ns: int, name: str, text: str, severity: Severity = Severity.INFO) -> Log:
    """A line of text that viewers show."""
    return Log(timestamp=timestamp(time_ns), level=_LOG_LEVEL[severity], name=name, message=text)


def encode_attachment_note(attachment: AttachmentRecord, time_ns: int) -> v1.AttachmentNote:
    """Size and digest of an attachment: MCAP readers do not check its checksum."""
    return v1.AttachmentNote(
        timestamp=timestamp(time_ns),
        name=attachment.name,
        media_type=attachment.media_type,
        size=len(attachment.data),
        sha256=hashlib.sha256(attachment.data).hexdigest(),
    )


def encode_registration(result: RegistrationRecord) -> v1.Registration:
    """Where the object was found, with its rivals."""
    return v1.Registration(
        timestamp=timestamp(result.time_ns),
        T_world_object=flat(result.T_world_object),
        T_camera_object=flat(result.T_camera_object),
        covariance=flat(result.covariance),
        stable_pose=result.stable_pose,
        ambiguous=result.ambiguous,
        contradicts_declared=result.contradicts_declared,
        quality=dict(result.quality),
        rivals=[
            v1.Rival(
                T_world_object=flat(rival.T_world_object),
                stable_pose=rival.stable_pose,
                render_cost=rival.render_cost,
            )
            for rival in result.rivals
        ],
        unobservable=result.unobservable,
        seed=result.seed,
        seconds=dict(result.seconds),
    )


def encode_execution(execution: ExecutionRecord) -> v1.Execution:
    """What the robot really did."""
    return v1.Execution(
        timestamp=timestamp(execution.time_ns),
        executed=encode_grasp(execution.executed),
        T_world_gripper_commanded=flat(execution.T_world_gripper_commanded),
        T_world_gripper=flat(execution.T_world_gripper),
        sensor_verdict=execution.sensor_verdict,
        measurements=dict(execution.measurements),
        details=dict(execution.details),
    )


def encode_stop(stop: TrialStop) -> v1.TrialStop:
    """How and why the trial ended."""
    return v1.TrialStop(
        timestamp=timestamp(stop.time_ns),
        exit_status=stop.exit_status.value,
        reason=stop.reason,
        message_counts=dict(stop.message_counts),
    )


def encode_metadata(descriptor: TrialDescriptor) -> dict[str, str]:
    """What a record's metadata tells other tools; readers here trust the messages."""
    known = {
        "trial_id": descriptor.trial_id,
        "session_id": descriptor.session_id,
        "number": str(descriptor.number),
        "take": str(descriptor.take),
        "object": descriptor.object_name,
        "seed": str(descriptor.seed),
        "simulated": str(descriptor.simulated).lower(),
    }
    versions = {f"version.{name}": value for name, value in descriptor.versions.items()}
    return {**descriptor.metadata, **versions, **known}
