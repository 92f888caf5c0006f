"""Saving what a killed process left of a record.

The unfinished file is read up to its first damage and copied, with a proper end, to the
record's own name; the original stays beside it as `trial.mcap.torn`. Every step is a rename or
can be done again, so that a kill during the rescue loses nothing either.
"""

from __future__ import annotations

import os
from dataclasses import dataclass
from pathlib import Path

from foxglove_schemas_protobuf.Log_pb2 import Log

from logs.durable import sync_directory
from logs.record import encode, topics
from logs.record.mcap_file import PART_SUFFIX, DurableMcap
from logs.record.mcap_walk import RawMessage, Walk, walk
from logs.record.records import EventKind, ExitStatus, Severity, TrialEvent, TrialStop
from logs.record.topics import message_type
from logs.trial_folder import PART_NAME, RECORD_NAME

TORN_NAME = "trial.mcap.torn"
_RESCUE_NAME = "trial.mcap.rescue"


@dataclass(frozen=True, slots=True)
class Salvage:
    """What became of an unfinished record.

    Args:
        folder: the take's folder.
        record: the saved record; None if not even its start could be read.
        original: where the unfinished file is kept.
        messages: how many messages were saved.
        damage: what stopped the reading.
        stopped: the record had its stop: nothing is missing but the file's end.
    """

    folder: Path
    record: Path | None
    original: Path
    messages: int
    damage: str | None
    stopped: bool


def salvage(folder: Path) -> Salvage | None:
    """Save a take's unfinished record; None if there is none.

    Raises:
        RecordWriteError: if the disk is full.
        OSError: if a rename fails.
    """
    part, rescued = folder / PART_NAME, folder / _RESCUE_NAME
    record = folder / RECORD_NAME
    if not part.exists() and not rescued.exists():
        return None
    (folder / (_RESCUE_NAME + PART_SUFFIX)).unlink(missing_ok=True)  # a rescue that was killed
    if record.exists():
        return _keep_beside(folder, part, record)
    if part.exists():
        rescued.unlink(missing_ok=True)
        found = walk(part)
        usable = bool(found.messages) and found.messages[0].topic == topics.START
        if usable:
            _copy(found, rescued)
        original = _set_aside(part)
    else:  # killed between the two renames
        original = _torn_files(folder)[-1]
        found, usable = walk(original), True
    if usable:
        os.rename(rescued, record)
    sync_directory(folder)
    return Salvage(
        folder=folder,
        record=record if usable else None,
        original=original,
        messages=len(found.messages),
        damage=found.damage,
        stopped=_stopped(found),
    )


def _keep_beside(folder: Path, part: Path, record: Path) -> Salvage:
    """A finished record has the name already: it stands, the other file is only set aside."""
    rescued = folder / _RESCUE_NAME
    original = _set_aside(part) if part.exists() else _set_aside(rescued)
    found = walk(record)
    sync_directory(folder)
    return Salvage(folder, record, original, len(found.messages), found.damage, _stopped(found))


def _copy(found: Walk, out: Path) -> None:
    """Write a record's readable part to a new file, with an end that says what happened."""
    last = found.messages[-1]
    with DurableMcap(out) as file:
        for attachment in found.attachments.values():
            file.attach(attachment, found.messages[0].log_time)
        for message in found.messages:
            _copy_message(file, message)
        if not _stopped(found):
            _write_end(file, found, last.log_time)
        file.finish()


def _copy_message(file: DurableMcap, raw: RawMessage) -> None:
    kind = message_type(raw.topic)
    if kind is not None:
        file.message(
            raw.topic,
            kind.FromString(raw.data),
            capture_ns=raw.publish_time,
            receive_ns=raw.log_time,
        )


def _write_end(file: DurableMcap, found: Walk, time_ns: int) -> None:
    reason = f"the process was killed; {len(found.messages)} messages were saved"
    event = TrialEvent(time_ns, EventKind.NOTE, "salvaged", reason, Severity.WARNING)
    line: Log = encode.encode_event_log(event)
    file.message(topics.EVENT, encode.encode_event(event), capture_ns=time_ns, receive_ns=time_ns)
    file.message(topics.LOG, line, capture_ns=time_ns, receive_ns=time_ns)
    stop = encode.encode_stop(TrialStop(time_ns, ExitStatus.ABORT, reason, dict(file.counts)))
    file.message(topics.STOP, stop, capture_ns=time_ns, receive_ns=time_ns)


def _stopped(found: Walk) -> bool:
    return any(message.topic == topics.STOP for message in found.messages)


def _set_aside(path: Path) -> Path:
    """Rename to the first free `.torn` name."""
    number = len(_torn_files(path.parent)) + 1
    target = path.with_name(TORN_NAME if number == 1 else f"{TORN_NAME}{number}")
    os.rename(path, target)
    return target


def _torn_files(folder: Path) -> list[Path]:
    return sorted(folder.glob(f"{TORN_NAME}*"))
