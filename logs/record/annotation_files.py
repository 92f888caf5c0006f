"""Writing and reading annotation files."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from google.protobuf.message import DecodeError, Message

from logs.errors import RecordWriteError
from logs.record import topics
from logs.record.annotations import Annotations, LabelRecord, PatchRecord, ScoreRecord
from logs.record.encode import flat, log_line
from logs.record.mcap_file import DurableMcap
from logs.record.mcap_walk import walk
from logs.record.stamps import nanoseconds, timestamp
from logs.schema import trial_v1_pb2 as v1
from logs.trial_folder import annotation_path, annotation_paths, next_annotation_number
from reach.errors import InvalidInputError

_ATTEMPTS = 100


def write_annotation(folder: Path, annotation: LabelRecord | ScoreRecord) -> Path:
    """Write a label or a score beside a take's record; durable when this returns.

    Args:
        folder: the take's folder.
        annotation: what to write.

    Returns:
        The new file.

    Raises:
        RecordWriteError: if the folder is missing or the disk fails.
    """
    if not folder.is_dir():
        raise RecordWriteError(f"no take's folder at {folder}")
    file = _claim(folder)
    topic, message, text = _encoded(annotation)
    stamp = annotation.time_ns
    try:
        with file:
            file.message(topic, message, capture_ns=stamp, receive_ns=stamp)
            line = log_line(stamp, topic.rsplit("/", 1)[-1], text)
            file.message(topics.ANNOTATION_LOG, line, capture_ns=stamp, receive_ns=stamp)
            return file.finish()
    except OSError as error:
        raise RecordWriteError(f"cannot write {file.part}: {error}") from error


def read_annotations(folder: Path) -> Annotations:
    """All labels and scores beside a take's record; a damaged file is named, never fatal."""
    labels: list[LabelRecord] = []
    scores: list[ScoreRecord] = []
    damaged: list[tuple[Path, str]] = []
    for path in annotation_paths(folder):
        found = walk(path)
        if found.damage:
            damaged.append((path, found.damage))
        try:
            for message in found.messages:
                if message.topic == topics.LABEL:
                    labels.append(_decode_label(message.data))
                elif message.topic == topics.SCORE:
                    scores.append(_decode_score(message.data))
        except (DecodeError, InvalidInputError, ValueError) as error:
            damaged.append((path, f"{type(error).__name__}: {error}"))
    return Annotations(tuple(labels), tuple(scores), tuple(damaged))


def _claim(folder: Path) -> DurableMcap:
    """The next free number: another process may write beside us."""
    for _ in range(_ATTEMPTS):
        path = annotation_path(folder, next_annotation_number(folder))
        try:
            return DurableMcap(path)
        except RecordWriteError as error:
            if not isinstance(error.__cause__, FileExistsError):
                raise
    raise RecordWriteError(f"no free annotation number in {folder}")


def _encoded(annotation: LabelRecord | ScoreRecord) -> tuple[str, Message, str]:
    if isinstance(annotation, ScoreRecord):
        text = f"{annotation.model} {annotation.version}: {annotation.value:.3f}"
        return topics.SCORE, encode_score(annotation), text
    if annotation.withdraws:
        return topics.LABEL, encode_label(annotation), f"label {annotation.withdraws} withdrawn"
    words = (annotation.outcome, annotation.reason, annotation.note)
    return topics.LABEL, encode_label(annotation), ", ".join(word for word in words if word)


def encode_label(label: LabelRecord) -> v1.Label:
    """A label as a message."""
    return v1.Label(
        timestamp=timestamp(label.time_ns),
        trial_id=label.trial_id,
        take=label.take,
        event_id=label.event_id,
        revision=label.revision,
        outcome=label.outcome,
        reason=label.reason,
        note=label.note,
        operator=label.operator,
        withdraws=label.withdraws,
        second=label.second,
        details=dict(label.details),
    )


def encode_score(score: ScoreRecord) -> v1.Score:
    """A score as a message."""
    return v1.Score(
        timestamp=timestamp(score.time_ns),
        trial_id=score.trial_id,
        take=score.take,
        event_id=score.event_id,
        revision=score.revision,
        model=score.model,
        version=score.version,
        parameters=dict(score.parameters),
        value=score.value,
        seconds=score.seconds,
        explanation=score.explanation,
        details=dict(score.details),
        texts=dict(score.texts),
        patches=[
            v1.ContactPatch(
                jaw=patch.jaw,
                triangles=flat(patch.triangles_object),
                pressures=flat(patch.pressures),
                area=patch.area,
                center=flat(patch.center_object),
                normal=flat(patch.normal_object),
                force=flat(patch.force_object),
                T_object_pad=flat(patch.T_object_pad),
            )
            for patch in score.patches
        ],
    )


def _decode_label(data: bytes) -> LabelRecord:
    message = v1.Label.FromString(data)
    return LabelRecord(
        trial_id=message.trial_id,
        take=message.take,
        time_ns=nanoseconds(message.timestamp),
        event_id=message.event_id,
        revision=message.revision,
        outcome=message.outcome,
        reason=message.reason,
        note=message.note,
        operator=message.operator,
        withdraws=message.withdraws,
        second=message.second,
        details=dict(message.details),
    )


def _decode_score(data: bytes) -> ScoreRecord:
    message = v1.Score.FromString(data)
    return ScoreRecord(
        trial_id=message.trial_id,
        take=message.take,
        time_ns=nanoseconds(message.timestamp),
        event_id=message.event_id,
        revision=message.revision,
        model=message.model,
        version=message.version,
        value=message.value,
        seconds=message.seconds,
        parameters=dict(message.parameters),
        explanation=message.explanation,
        details=dict(message.details),
        texts=dict(message.texts),
        patches=tuple(map(_decode_patch, message.patches)),
    )


def _decode_patch(message: v1.ContactPatch) -> PatchRecord:
    return PatchRecord(
        jaw=message.jaw,
        triangles_object=np.array(message.triangles),
        pressures=np.array(message.pressures),
        area=message.area,
        center_object=np.array(message.center),
        normal_object=np.array(message.normal),
        force_object=np.array(message.force),
        T_object_pad=np.array(message.T_object_pad),
    )
