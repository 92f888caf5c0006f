"""A record without its measurements, read through its summary: what lists and data sets need.

A finished record's summary says which chunks hold which channel; only those are read, and their
checksums verified. A record without a good summary is read whole.
"""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import BinaryIO

from mcap.reader import SeekingReader

from logs.errors import RecordReadError
from logs.record import topics
from logs.record.decode_streams import decode_colors, decode_depths
from logs.record.decode_v1 import decode_record
from logs.record.indexed import indexed_messages
from logs.record.mcap_walk import RawMessage
from logs.record.records import FORMAT_VERSION
from logs.record.streams import ColorImage, DepthImage
from logs.record.trial_record import TrialRecord, read_record
from logs.schema import trial_v1_pb2 as v1

_RESULTS = (topics.START, topics.DESCRIPTOR, topics.REGISTRATION, topics.EXECUTION, topics.STOP)


def read_outline(path: Path) -> TrialRecord:
    """Read what was tried, found and done, and how it ended: no measurements, events or files.

    Raises:
        RecordReadError: if not even the start can be read.
        UnknownFormatError: if a later release wrote it.
    """
    try:
        with path.open("rb") as stream:
            found = indexed_messages(stream, _RESULTS)
    except OSError as error:
        raise RecordReadError(f"cannot read {path}: {error}") from error
    except Exception:  # any parser may meet any error in damaged bytes; reading whole tells which
        found = []
    ends = [message.topic for message in (*found[:1], *found[-1:])]
    if ends != [topics.START, topics.STOP]:
        return read_record(path, images=False)
    if v1.TrialStart.FromString(found[0].data).format_version != FORMAT_VERSION:
        return read_record(path, images=False)
    return decode_record(path, found, {}, None)


def read_attachment(path: Path, name: str) -> bytes:
    """Read one file that a record carries.

    Raises:
        RecordReadError: if the record cannot be read or holds no such file.
    """
    try:
        with path.open("rb") as stream:
            found = {one.name: one.data for one in _reader(stream).iter_attachments()}
    except Exception:  # as above
        found = {one.name: one.data for one in read_record(path, images=False).attachments.values()}
    if name not in found:
        raise RecordReadError(f"{path} holds no {name}; it has: {', '.join(found) or 'none'}")
    return bytes(found[name])


def first_image(path: Path) -> ColorImage | DepthImage | None:
    """A record's first color frame, or else its first depth image; None if neither can be read."""
    try:
        with path.open("rb") as stream:
            reader = _reader(stream)
            summary = reader.get_summary()
            channels = {one.topic for one in summary.channels.values()} if summary else set()
            color, depth = (
                [topic for topic in channels if topics.is_camera_topic(topic, what)]
                for what in ("color", "depth")
            )
            for message in _messages(reader, color or depth):
                one = {message.topic: [message.data]}
                return decode_colors(one)[0] if color else decode_depths(one)[0]
    except Exception:  # as above; a list can do without a picture
        pass
    return None


def _reader(stream: BinaryIO) -> SeekingReader:
    size = os.fstat(stream.fileno()).st_size
    return SeekingReader(stream, validate_crcs=True, record_size_limit=size)


def _messages(reader: SeekingReader, wanted: Iterable[str]) -> Iterator[RawMessage]:
    """Messages of some channels in the order of writing."""
    found = reader.iter_messages(topics=list(wanted), log_time_order=False)
    for schema, channel, message in found:
        name = schema.name if schema else ""
        yield RawMessage(channel.topic, name, message.data, message.log_time, message.publish_time)
