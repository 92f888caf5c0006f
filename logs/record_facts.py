"""The few messages of a record that a data set needs, without reading its images.

A finished record's summary says which chunks hold which channel; only those are read, and
their checksums verified. A record without a summary is read whole.
"""

from __future__ import annotations

import hashlib
import io
import os
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path

from logs import topics
from logs.decode_v1 import decode_descriptor, decode_execution, decode_registration
from logs.descriptions import GRIPPER_DESCRIPTION, read_gripper
from logs.errors import RecordReadError
from logs.mesh_attachment import OBJECT_MESH, read_mesh
from logs.records import FORMAT_VERSION, ExecutionRecord, RegistrationRecord, TrialDescriptor
from logs.schema import trial_v1_pb2 as v1
from logs.trial_record import read_record
from reach.arrays import FloatArray, IntArray
from reach.gripper import ParallelJawGripper

_WANTED = (topics.START, topics.DESCRIPTOR, topics.REGISTRATION, topics.EXECUTION)


@dataclass(frozen=True, slots=True, eq=False)
class RecordFacts:
    """What a data set takes from a record.

    Args:
        path: the file.
        sha256: of it.
        descriptor: which trial, and what was tried.
        registration: the one that counts.
        execution: the one that counts.
    """

    path: Path
    sha256: str
    descriptor: TrialDescriptor
    registration: RegistrationRecord | None
    execution: ExecutionRecord | None

    @property
    def mesh(self) -> tuple[FloatArray, IntArray]:
        """Vertices and faces of the object, read from the record now."""
        return read_mesh(self._attachment(OBJECT_MESH))

    @property
    def gripper(self) -> ParallelJawGripper:
        """The hand, read from the record now."""
        return read_gripper(self._attachment(GRIPPER_DESCRIPTION))

    def _attachment(self, name: str) -> bytes:
        attachments = read_record(self.path, images=False).attachments
        if name not in attachments:
            raise RecordReadError(f"{self.path} holds no {name}; it has: {', '.join(attachments)}")
        return attachments[name].data


def read_facts(paths: Sequence[Path]) -> list[RecordFacts]:
    """Facts of many records, in their order.

    Raises:
        RecordReadError: a record is missing or cannot be read.
    """
    # Reading and hashing release the interpreter's lock: both cores work.
    with ThreadPoolExecutor(max_workers=os.cpu_count() or 1) as pool:
        return list(pool.map(_facts, paths))


def _facts(path: Path) -> RecordFacts:
    try:
        data = path.read_bytes()
    except OSError as error:
        raise RecordReadError(f"cannot read a trial's record: {error}") from error
    digest = hashlib.sha256(data).hexdigest()
    found = _by_summary(data)
    if found is None:
        record = read_record(path, images=False)
        return RecordFacts(path, digest, record.descriptor, record.registration, record.execution)
    registrations, executions = found[topics.REGISTRATION], found[topics.EXECUTION]
    return RecordFacts(
        path,
        digest,
        decode_descriptor(found[topics.START][0], found[topics.DESCRIPTOR][0]),
        decode_registration(registrations[-1]) if registrations else None,
        decode_execution(executions[-1]) if executions else None,
    )


def _by_summary(data: bytes) -> dict[str, list[bytes]] | None:
    """Wanted messages by channel, or None if the file must be read whole."""
    from mcap.exceptions import McapError
    from mcap.reader import SeekingReader

    found: dict[str, list[bytes]] = {topic: [] for topic in _WANTED}
    try:
        reader = SeekingReader(io.BytesIO(data), validate_crcs=True)
        if reader.get_summary() is None:
            return None
        for _, channel, message in reader.iter_messages(topics=_WANTED, log_time_order=False):
            found[channel.topic].append(message.data)
    except (McapError, ValueError, EOFError):
        return None
    if not found[topics.START] or not found[topics.DESCRIPTOR]:
        return None
    version = v1.TrialStart.FromString(found[topics.START][0]).format_version
    return found if version == FORMAT_VERSION else None
