"""Time stamps: int nanoseconds inside, protobuf's time stamp in messages."""

from __future__ import annotations

from google.protobuf.timestamp_pb2 import Timestamp

NS = 1_000_000_000
"""Nanoseconds in a second."""


def timestamp(time_ns: int) -> Timestamp:
    """Nanoseconds as protobuf's time stamp."""
    return Timestamp(seconds=time_ns // NS, nanos=time_ns % NS)


def nanoseconds(stamp: Timestamp) -> int:
    """Protobuf's time stamp as nanoseconds."""
    return stamp.seconds * NS + stamp.nanos
