"""Writing an MCAP file that is durable at every flush and never half-finished under its name.

Facts this relies on (mcap 1.6): a chunk that is not flushed is lost with the process; `flush`
closes the chunk but does not fsync; attachments and metadata go straight to the file.
"""

from __future__ import annotations

import os
from collections import Counter
from collections.abc import Mapping
from pathlib import Path
from types import TracebackType
from typing import Self

from google.protobuf.message import Message
from mcap.writer import CompressionType, Writer
from mcap_protobuf.schema import build_file_descriptor_set

from logs.durable import sync_directory
from logs.errors import RecordWriteError
from logs.record.records import FORMAT_VERSION, AttachmentRecord

PROFILE = "reach-trials"
LIBRARY = f"reach-trials format {FORMAT_VERSION}"
PART_SUFFIX = ".part"


class DurableMcap:
    """One MCAP file under construction, named `*.part` until it is finished.

    Every message carries its place in the file (0, 1, 2, ...) as sequence number, whatever its
    channel: a reader that finds the numbers without a hole has found everything.

    Args:
        path: the finished file's name; its folder must exist.

    Raises:
        RecordWriteError: if the file or an unfinished one exists already, or cannot be opened.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self.part = path.with_name(path.name + PART_SUFFIX)
        self.counts: Counter[str] = Counter()
        self._channels: dict[str, int] = {}
        self._schemas: dict[str, int] = {}
        if path.exists():
            raise RecordWriteError(f"{path} exists already; a finished record is never rewritten")
        try:
            self._stream = open(self.part, "xb")  # noqa: SIM115 - closed by finish or abandon
        except FileExistsError as error:
            raise RecordWriteError(
                f"{self.part} exists already; `reach recover` salvages it"
            ) from error
        except OSError as error:
            raise RecordWriteError(f"cannot write {self.part}: {error}") from error
        try:
            self._writer = Writer(
                self._stream, compression=CompressionType.LZ4, enable_data_crcs=True
            )
            self._writer.start(profile=PROFILE, library=LIBRARY)
        except BaseException:
            self.abandon()
            raise

    def message(self, topic: str, message: Message, *, capture_ns: int, receive_ns: int) -> None:
        """Append a message; it is durable after the next flush."""
        channel = self._channels.get(topic)
        if channel is None:
            channel = self._register(topic, message)
        self._writer.add_message(
            channel,
            log_time=receive_ns,
            publish_time=capture_ns,
            data=message.SerializeToString(),
            sequence=self.counts.total(),
        )
        self.counts[topic] += 1

    def attach(self, attachment: AttachmentRecord, time_ns: int) -> None:
        """Add an attachment."""
        self._writer.add_attachment(
            create_time=time_ns,
            log_time=time_ns,
            name=attachment.name,
            media_type=attachment.media_type,
            data=attachment.data,
        )

    def metadata(self, name: str, data: Mapping[str, str]) -> None:
        """Add a block of metadata, for other tools: the project's readers trust the messages."""
        self._writer.add_metadata(name, dict(data))

    def flush(self) -> None:
        """Make everything so far durable: close the chunk and fsync."""
        self._writer.flush()
        os.fsync(self._stream.fileno())

    def finish(self) -> Path:
        """Write the summary, fsync, and give the file its name."""
        self._writer.finish()
        self._stream.flush()
        os.fsync(self._stream.fileno())
        self._stream.close()
        if self.path.exists():
            raise RecordWriteError(f"{self.path} appeared meanwhile; kept {self.part} beside it")
        os.rename(self.part, self.path)
        sync_directory(self.path.parent)
        return self.path

    def abandon(self) -> None:
        """Close without finishing: the `.part` file stays, for recovery."""
        try:
            self._stream.close()
        except OSError:
            self._stream.raw.close()  # the buffer's rest cannot be written: drop it

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        if not self._stream.closed:
            self.abandon()

    def _register(self, topic: str, message: Message) -> int:
        name = message.DESCRIPTOR.full_name
        if name not in self._schemas:
            described = build_file_descriptor_set(type(message)).SerializeToString()
            self._schemas[name] = self._writer.register_schema(name, "protobuf", described)
        self._channels[topic] = self._writer.register_channel(
            topic, "protobuf", self._schemas[name]
        )
        return self._channels[topic]
