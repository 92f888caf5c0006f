"""A record's few results, read through its summary: what the index lists."""

from __future__ import annotations

import os
from dataclasses import dataclass
from pathlib import Path

from mcap.reader import SeekingReader

from logs import topics
from logs.decode_v1 import decode_descriptor, decode_execution, decode_registration, decode_stop
from logs.errors import RecordReadError
from logs.records import (
    FORMAT_VERSION,
    ExecutionRecord,
    RegistrationRecord,
    TrialDescriptor,
    TrialStop,
)
from logs.schema import trial_v1_pb2 as v1
from logs.trial_record import TrialRecord, read_record

_RESULTS = (topics.START, topics.DESCRIPTOR, topics.REGISTRATION, topics.EXECUTION, topics.STOP)


@dataclass(frozen=True, slots=True, eq=False)
class RecordBrief:
    """What a record says without its measurements.

    Args:
        descriptor: which trial, and what was tried.
        registration: the one that counts.
        execution: the one that counts.
        stop: how it ended.
        damage: what stopped the reading.
    """

    descriptor: TrialDescriptor
    registration: RegistrationRecord | None
    execution: ExecutionRecord | None
    stop: TrialStop | None
    damage: str | None = None


def read_brief(path: Path) -> RecordBrief:
    """Read a record's results; a file without a good summary is read whole.

    Raises:
        RecordReadError: if not even the start can be read.
        UnknownFormatError: if a later release wrote it.
    """
    found = _through_summary(path)
    if found is None or topics.STOP not in found:
        return _of_record(read_record(path, images=False))
    if v1.TrialStart.FromString(found[topics.START]).format_version != FORMAT_VERSION:
        return _of_record(read_record(path, images=False))
    registration, execution = found.get(topics.REGISTRATION), found.get(topics.EXECUTION)
    return RecordBrief(
        descriptor=decode_descriptor(found[topics.START], found[topics.DESCRIPTOR]),
        registration=decode_registration(registration) if registration else None,
        execution=decode_execution(execution) if execution else None,
        stop=decode_stop(found[topics.STOP]),
    )


def _through_summary(path: Path) -> dict[str, bytes] | None:
    """Newest message of each result's channel, or None if the file's summary is not to be had."""
    try:
        with path.open("rb") as stream:
            size = os.fstat(stream.fileno()).st_size
            reader = SeekingReader(stream, validate_crcs=True, record_size_limit=size)
            messages = reader.iter_messages(topics=_RESULTS, log_time_order=False)
            return {channel.topic: message.data for _, channel, message in messages}
    except OSError as error:
        raise RecordReadError(f"cannot read {path}: {error}") from error
    except Exception:  # any parser may meet any error in damaged bytes; the walk tells which
        return None


def _of_record(record: TrialRecord) -> RecordBrief:
    return RecordBrief(
        record.descriptor, record.registration, record.execution, record.stop, record.damage
    )
