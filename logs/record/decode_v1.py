"""Messages of format 1 to records. The inverse is [logs.record.encode][]."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from logs.errors import RecordReadError
from logs.record import decode_streams, topics
from logs.record.mcap_walk import RawMessage
from logs.record.records import (
    AttachmentRecord,
    EventKind,
    ExecutionRecord,
    ExitStatus,
    RegistrationRecord,
    RivalRecord,
    Severity,
    TrialDescriptor,
    TrialEvent,
    TrialStop,
)
from logs.record.stamps import nanoseconds
from logs.record.trial_record import TrialRecord
from logs.schema import trial_v1_pb2 as v1
from reach.arrays import FloatArray
from reach.grasp import Grasp


def decode_record(
    path: Path,
    messages: Sequence[RawMessage],
    attachments: Mapping[str, AttachmentRecord],
    damage: str | None,
) -> TrialRecord:
    """Assemble a record of format 1.

    Raises:
        RecordReadError: if the descriptor is missing.
    """
    by_topic: dict[str, list[bytes]] = {}
    for message in messages:
        by_topic.setdefault(message.topic, []).append(message.data)
    if topics.DESCRIPTOR not in by_topic:
        raise RecordReadError(f"{path} ends before its descriptor ({damage})")
    events = tuple(map(decode_event, by_topic.get(topics.EVENT, ())))
    stops = by_topic.get(topics.STOP, ())
    frames = decode_streams.decode_frames(by_topic.get(topics.FRAMES, ()))
    return TrialRecord(
        path=path,
        format_version=1,
        descriptor=decode_descriptor(by_topic[topics.START][0], by_topic[topics.DESCRIPTOR][0]),
        stop=decode_stop(stops[0]) if stops else None,
        damage=damage,
        events=events,
        cameras=decode_streams.decode_cameras(by_topic, events, frames),
        depth=decode_streams.decode_depths(by_topic),
        color=decode_streams.decode_colors(by_topic),
        clouds=decode_streams.decode_clouds(by_topic),
        frames=frames,
        joints=decode_streams.decode_joints(by_topic.get(topics.JOINTS, ())),
        jaw=decode_streams.decode_jaw(by_topic.get(topics.JAW, ())),
        registrations=tuple(map(decode_registration, by_topic.get(topics.REGISTRATION, ()))),
        executions=tuple(map(decode_execution, by_topic.get(topics.EXECUTION, ()))),
        attachments=dict(attachments),
        message_count=len(messages),
    )


def matrix(numbers: Sequence[float], rows: int = 4) -> FloatArray:
    """A square matrix from its numbers row by row."""
    return np.array(numbers, dtype=float).reshape(rows, rows)


def decode_grasp(message: v1.Grasp) -> Grasp:
    """A grasp, bit for bit."""
    opening = message.opening if message.HasField("opening") else None
    return Grasp(matrix(message.T_object_gripper), opening, message.force)


def decode_descriptor(start_data: bytes, descriptor_data: bytes) -> TrialDescriptor:
    """Which trial, and what was tried."""
    start = v1.TrialStart.FromString(start_data)
    what = v1.TrialDescriptor.FromString(descriptor_data)
    return TrialDescriptor(
        trial_id=start.trial_id,
        session_id=start.session_id,
        number=start.number,
        object_name=what.object_name,
        object_hash=what.object_hash,
        object_mass=what.object_mass,
        center_of_mass=np.array(what.center_of_mass),
        stable_pose=what.stable_pose,
        T_world_object=matrix(what.T_world_object),
        planned=decode_grasp(what.planned),
        gripper_name=what.gripper_name,
        grasp_id=start.grasp_id,
        repeat=start.repeat,
        take=start.take,
        seed=start.seed,
        simulated=start.simulated,
        time_ns=nanoseconds(start.timestamp),
        versions=dict(start.versions),
        metadata=dict(start.metadata),
    )


def decode_event(data: bytes) -> TrialEvent:
    """An event of the trial."""
    message = v1.TrialEvent.FromString(data)
    return TrialEvent(
        nanoseconds(message.timestamp),
        EventKind(message.kind),
        message.name,
        message.message,
        Severity[v1.TrialEvent.Severity.Name(message.severity)],
        dict(message.data),
    )


def decode_registration(data: bytes) -> RegistrationRecord:
    """Where the object was found."""
    message = v1.Registration.FromString(data)
    return RegistrationRecord(
        time_ns=nanoseconds(message.timestamp),
        T_world_object=matrix(message.T_world_object),
        T_camera_object=matrix(message.T_camera_object),
        covariance=matrix(message.covariance, 6),
        stable_pose=message.stable_pose if message.HasField("stable_pose") else None,
        ambiguous=message.ambiguous,
        contradicts_declared=message.contradicts_declared,
        quality=dict(message.quality),
        rivals=tuple(map(_decode_rival, message.rivals)),
        unobservable=tuple(message.unobservable),
        seed=message.seed,
        seconds=dict(message.seconds),
    )


def _decode_rival(message: v1.Rival) -> RivalRecord:
    stable_pose = message.stable_pose if message.HasField("stable_pose") else None
    return RivalRecord(matrix(message.T_world_object), stable_pose, message.render_cost)


def decode_execution(data: bytes) -> ExecutionRecord:
    """What the robot really did."""
    message = v1.Execution.FromString(data)
    return ExecutionRecord(
        time_ns=nanoseconds(message.timestamp),
        T_world_gripper_commanded=matrix(message.T_world_gripper_commanded),
        T_world_gripper=matrix(message.T_world_gripper),
        executed=decode_grasp(message.executed),
        sensor_verdict=message.sensor_verdict,
        measurements=dict(message.measurements),
        details=dict(message.details),
    )


def decode_stop(data: bytes) -> TrialStop:
    """How and why the trial ended."""
    message = v1.TrialStop.FromString(data)
    return TrialStop(
        nanoseconds(message.timestamp),
        ExitStatus(message.exit_status),
        message.reason,
        dict(message.message_counts),
    )
