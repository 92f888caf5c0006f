"""Reading an MCAP file front to back and stopping at the first damage.

What comes back is a prefix of what was written: checksums guard every message, the sequence
number (a message's place in the file) shows a hole, and an attachment counts only if the
message after it confirms size and digest. A file that was cut short, or that has flipped
bits, yields fewer messages, never wrong ones.
"""

from __future__ import annotations

import hashlib
import struct
import zlib
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import BinaryIO

from mcap.opcode import Opcode
from mcap.records import Attachment, Channel, Chunk, DataEnd, McapRecord, Message, Schema
from mcap.stream_reader import StreamReader, breakup_chunk

from logs.errors import RecordReadError
from logs.record import topics
from logs.record.records import AttachmentRecord
from logs.schema import trial_v1_pb2 as v1

_MAGIC = b"\x89MCAP0\r\n"
_FOOTER = struct.Struct("<BQQQI")


@dataclass(frozen=True, slots=True)
class RawMessage:
    """A message as it stands in the file.

    Args:
        topic: name of its channel.
        schema: full name of its type.
        data: the encoded message; empty if the reader did not want it.
        log_time: of receipt [ns].
        publish_time: of capture [ns].
    """

    topic: str
    schema: str
    data: bytes
    log_time: int
    publish_time: int


@dataclass(slots=True)
class Walk:
    """What a file holds before its first damage.

    Args:
        messages: in the order of writing.
        attachments: the confirmed ones, by name.
        finished: the file was closed in order and its summary is whole.
        damage: what stopped the reading; None if nothing did.
    """

    messages: list[RawMessage] = field(default_factory=list)
    attachments: dict[str, AttachmentRecord] = field(default_factory=dict)
    finished: bool = False
    damage: str | None = None


class _DamageError(Exception):
    """The file cannot be trusted from here on."""


class _Exact:
    """A stream that refuses to return fewer bytes than asked for."""

    def __init__(self, stream: BinaryIO) -> None:
        self._stream = stream

    def read(self, size: int) -> bytes:
        data = self._stream.read(size)
        if len(data) != size:
            raise _DamageError("the file ends early")
        return data


def walk(path: Path, wanted: Callable[[str], bool] = lambda topic: True) -> Walk:
    """Read a file's trustworthy prefix.

    Args:
        path: the file, finished or not.
        wanted: whether a topic's data is kept; everything is checked either way.

    Raises:
        RecordReadError: if the file cannot be opened or read at all.
    """
    result = Walk()
    try:
        with open(path, "rb") as stream:
            size = path.stat().st_size
            _walk_data(stream, size, result, wanted)
            _check_summary(stream)
            result.finished = True
    except _DamageError as damage:
        result.damage = str(damage)
    except OSError as error:
        raise RecordReadError(f"cannot read {path}: {error}") from error
    except Exception as error:  # any parser may meet any error in damaged bytes
        result.damage = f"{type(error).__name__}: {error}"
    return result


def _walk_data(stream: BinaryIO, size: int, result: Walk, wanted: Callable[[str], bool]) -> None:
    reader = StreamReader(
        _Exact(stream),
        emit_chunks=True,
        validate_crcs=True,
        record_size_limit=size,
    )
    state = _State(result, wanted)
    for record in reader.records:
        if isinstance(record, DataEnd):
            return
        for inner in _records_within(record):
            state.take(inner)


def _records_within(record: McapRecord) -> Iterator[McapRecord]:
    if not isinstance(record, Chunk):
        yield record
        return
    if record.uncompressed_crc == 0:
        raise _DamageError("a chunk has no checksum")
    yield from breakup_chunk(record, validate_crc=True)


class _State:
    """Channels met so far, and attachments waiting for their confirmation."""

    def __init__(self, result: Walk, wanted: Callable[[str], bool]) -> None:
        self._result = result
        self._wanted = wanted
        self._schemas: dict[int, str] = {}
        self._channels: dict[int, tuple[str, str]] = {}
        self._pending: dict[str, Attachment] = {}

    def take(self, record: McapRecord) -> None:
        if isinstance(record, Schema):
            self._schemas[record.id] = record.name
        elif isinstance(record, Channel):
            self._channels[record.id] = (record.topic, self._schemas[record.schema_id])
        elif isinstance(record, Attachment):
            self._pending[record.name] = record
        elif isinstance(record, Message):
            self._take_message(record)

    def _take_message(self, message: Message) -> None:
        expected = len(self._result.messages)
        if message.sequence != expected:
            raise _DamageError(f"message {expected} is missing: {message.sequence} follows")
        topic, schema = self._channels[message.channel_id]
        if topic == topics.ATTACHMENT:
            self._confirm(v1.AttachmentNote.FromString(message.data))
        data = message.data if self._wanted(topic) else b""
        self._result.messages.append(
            RawMessage(topic, schema, data, message.log_time, message.publish_time)
        )

    def _confirm(self, note: v1.AttachmentNote) -> None:
        found = self._pending.pop(note.name, None)
        digest = hashlib.sha256(found.data).hexdigest() if found else ""
        if found is None or len(found.data) != note.size or digest != note.sha256:
            raise _DamageError(f"attachment {note.name!r} is missing or altered")
        self._result.attachments[note.name] = AttachmentRecord(
            note.name, note.media_type, found.data
        )


def _check_summary(stream: BinaryIO) -> None:
    """Check the part that only indexes: from the end of the data to the end of the file."""
    tail = stream.read()
    footer_size = _FOOTER.size + len(_MAGIC)
    if len(tail) < footer_size or not tail.endswith(_MAGIC):
        raise _DamageError("the file's summary ends early")
    footer = tail[-footer_size : -len(_MAGIC)]
    opcode, _, _, _, crc = _FOOTER.unpack(footer)
    if opcode != Opcode.FOOTER or crc != zlib.crc32(tail[:-footer_size] + footer[:-4]):
        raise _DamageError("the file's summary does not match its checksum")
