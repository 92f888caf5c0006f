"""A few channels' messages of a finished record, through its index: nothing else is parsed.

The `mcap` library's reader makes an object of every record in a summary and in each chunk that it
opens. A data set opens thousands of records for five messages each; here only those are unpacked.
Whatever does not fit raises, and the caller reads the record whole.

Layout: the MCAP specification, https://mcap.dev/spec. Decompression and checksums of chunks are the
library's.
"""

from __future__ import annotations

import io
import struct
import zlib
from collections.abc import Collection, Iterator
from typing import BinaryIO

from mcap.data_stream import ReadDataStream
from mcap.opcode import Opcode
from mcap.records import Chunk
from mcap.stream_reader import get_chunk_data_stream

from logs.errors import RecordReadError
from logs.record.mcap_walk import RawMessage

_MAGIC = b"\x89MCAP0\r\n"
_HEAD = struct.Struct("<BQ")  # of any record: opcode, length of its content
_FOOTER = struct.Struct("<BQQQI")  # opcode, length, start of summary, of its offsets, checksum
_CHANNEL = struct.Struct("<HH")  # id, schema's id; then the topic
_SCHEMA = struct.Struct("<H")  # id; then the name
_INDEX = struct.Struct("<QQQQI")  # first and last log time, place, length, bytes of offsets
_OFFSET = struct.Struct("<HQ")  # channel's id, place of its messages' index
_MESSAGE = struct.Struct("<HIQQ")  # channel's id, sequence, log time, publish time; then the data
_LENGTH = struct.Struct("<I")


def indexed_messages(stream: BinaryIO, wanted: Collection[str]) -> list[RawMessage]:
    """Messages of some channels in the order of writing.

    Args:
        stream: a finished record.
        wanted: topics.

    Raises:
        Exception: any, if the file has no whole summary, or a chunk is damaged.
    """
    schemas: dict[int, str] = {}
    channels: dict[int, tuple[str, str]] = {}
    chunks: list[tuple[int, int]] = []
    for opcode, content in _records(_summary(stream)):
        if opcode == Opcode.SCHEMA:
            schemas[_SCHEMA.unpack_from(content)[0]] = _text(content, _SCHEMA.size)
        elif opcode == Opcode.CHANNEL:
            number, schema = _CHANNEL.unpack_from(content)
            topic = _text(content, _CHANNEL.size)
            if topic in wanted:
                channels[number] = (topic, schemas.get(schema, ""))
        elif opcode == Opcode.CHUNK_INDEX:
            _, _, place, length, size = _INDEX.unpack_from(content)
            offsets = content[_INDEX.size : _INDEX.size + size]
            if any(channel in channels for channel, _ in _OFFSET.iter_unpack(offsets)):
                chunks.append((place, length))
    return [
        message
        for place, length in sorted(chunks)
        for message in _messages(_chunk(stream, place, length), channels)
    ]


def _summary(stream: BinaryIO) -> bytes:
    """The summary section, its checksum verified."""
    end = stream.seek(0, io.SEEK_END) - len(_MAGIC) - _FOOTER.size
    if end < 0:
        raise RecordReadError("the record was not finished")
    stream.seek(end)
    closing = stream.read()
    opcode, _, start, offsets, checksum = _FOOTER.unpack_from(closing)
    if opcode != Opcode.FOOTER or not closing.endswith(_MAGIC) or not 0 < start <= offsets <= end:
        raise RecordReadError("the record was not finished")
    stream.seek(start)
    content = stream.read(end - start)
    covered = content + closing[: _FOOTER.size - _LENGTH.size]
    if checksum not in (0, zlib.crc32(covered)):
        raise RecordReadError("the record's summary is damaged")
    return content[: offsets - start]


def _chunk(stream: BinaryIO, place: int, length: int) -> bytes:
    """A chunk's records, decompressed, their checksum verified."""
    stream.seek(place)
    content = stream.read(length)
    opcode, size = _HEAD.unpack_from(content)
    if opcode != Opcode.CHUNK or _HEAD.size + size != length:
        raise RecordReadError(f"no chunk at byte {place}")
    chunk = Chunk.read(ReadDataStream(io.BytesIO(content[_HEAD.size :])))
    if chunk.uncompressed_crc == 0:
        raise RecordReadError("a chunk has no checksum")
    records, size = get_chunk_data_stream(chunk, validate_crc=True)
    return bytes(records.read(size))


def _messages(records: bytes, channels: dict[int, tuple[str, str]]) -> Iterator[RawMessage]:
    for opcode, content in _records(records):
        if opcode != Opcode.MESSAGE:
            continue
        channel, _, log_time, publish_time = _MESSAGE.unpack_from(content)
        if channel in channels:
            data = bytes(content[_MESSAGE.size :])
            yield RawMessage(*channels[channel], data, log_time, publish_time)


def _records(content: bytes) -> Iterator[tuple[int, memoryview]]:
    """Opcode and content of the records that follow each other in some bytes."""
    view, at = memoryview(content), 0
    while at < len(content):
        opcode, size = _HEAD.unpack_from(content, at)
        at += _HEAD.size
        if at + size > len(content):
            raise RecordReadError("a record is cut short")
        yield opcode, view[at : at + size]
        at += size


def _text(content: memoryview, at: int) -> str:
    (size,) = _LENGTH.unpack_from(content, at)
    return str(content[at + _LENGTH.size : at + _LENGTH.size + size], "utf-8")
