"""A take's record as read back, and how to read one."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from google.protobuf.message import DecodeError

from logs.errors import RecordReadError, UnknownFormatError
from logs.record import topics
from logs.record.mcap_walk import RawMessage, walk
from logs.record.records import (
    AttachmentRecord,
    EventKind,
    ExecutionRecord,
    ExitStatus,
    RegistrationRecord,
    TrialDescriptor,
    TrialEvent,
    TrialStop,
)
from logs.record.streams import (
    CameraRecord,
    CloudRecord,
    ColorImage,
    DepthImage,
    FrameTrack,
    JawTrack,
    JointTrack,
)
from logs.schema import trial_v1_pb2 as v1
from logs.trial_folder import PART_NAME, RECORD_NAME
from reach.errors import InvalidInputError


@dataclass(frozen=True, slots=True, eq=False)
class TrialRecord:
    """Everything a record holds.

    Args:
        path: the file.
        format_version: of the file.
        descriptor: which trial, and what was tried.
        stop: how it ended; None if the record was cut short.
        damage: what stopped the reading, if something did; what is here is a correct prefix.
        events: in the order of writing.
        cameras: by name.
        depth: depth images.
        color: color frames, compressed.
        clouds: unorganized clouds.
        frames: moving frames, by the child's name.
        joints: one track for each set of joints.
        jaw: the jaws' width and force.
        registrations: results, oldest first; the last one counts.
        executions: executions, oldest first; the last one counts.
        attachments: by name.
        message_count: of the messages read.
    """

    path: Path
    format_version: int
    descriptor: TrialDescriptor
    stop: TrialStop | None
    damage: str | None
    events: tuple[TrialEvent, ...]
    cameras: Mapping[str, CameraRecord]
    depth: tuple[DepthImage, ...]
    color: tuple[ColorImage, ...]
    clouds: tuple[CloudRecord, ...]
    frames: Mapping[str, FrameTrack]
    joints: tuple[JointTrack, ...]
    jaw: JawTrack
    registrations: tuple[RegistrationRecord, ...]
    executions: tuple[ExecutionRecord, ...]
    attachments: Mapping[str, AttachmentRecord]
    message_count: int

    @property
    def complete(self) -> bool:
        """The record was stopped in order and is whole."""
        return self.stop is not None and self.damage is None

    @property
    def executed(self) -> bool:
        """The robot went through the whole trial, so that a label makes sense."""
        return self.stop is not None and self.stop.exit_status is ExitStatus.SUCCESS

    @property
    def registration(self) -> RegistrationRecord | None:
        """The registration that counts."""
        return self.registrations[-1] if self.registrations else None

    @property
    def execution(self) -> ExecutionRecord | None:
        """The execution that counts."""
        return self.executions[-1] if self.executions else None

    @property
    def gaps(self) -> tuple[TrialEvent, ...]:
        """Where measurements are missing."""
        return tuple(event for event in self.events if event.kind is EventKind.GAP)

    @property
    def phases(self) -> tuple[TrialEvent, ...]:
        """The phases' beginnings."""
        return tuple(event for event in self.events if event.kind is EventKind.PHASE)


def record_path(folder: Path) -> Path:
    """A take's record: the finished one, else the unfinished one.

    Raises:
        RecordReadError: if the folder has neither.
    """
    for name in (RECORD_NAME, PART_NAME):
        if (folder / name).exists():
            return folder / name
    raise RecordReadError(f"{folder} holds no record ({RECORD_NAME} or {PART_NAME})")


def read_record(path: Path, *, images: bool = True) -> TrialRecord:
    """Read a record, finished or not, of any format version ever released.

    Args:
        path: the file, or the take's folder.
        images: whether to keep depth, color and clouds; everything is checked either way.

    Raises:
        RecordReadError: if not even the first two messages can be read.
        UnknownFormatError: if a later release wrote it.
    """
    path = record_path(path) if path.is_dir() else path
    wanted = _everything if images else _but_images
    found = walk(path, wanted)
    version = _format_version(path, found.messages, found.damage)
    reader = _readers().get(version)
    if reader is None:
        known = ", ".join(map(str, sorted(_readers())))
        raise UnknownFormatError(f"{path} has record format {version}; this release reads {known}")
    try:
        return reader(path, found.messages, found.attachments, found.damage)
    except (DecodeError, InvalidInputError, KeyError, IndexError, ValueError) as error:
        raise RecordReadError(f"{path}: a message does not mean anything: {error}") from error


Reader = Callable[
    [Path, Sequence[RawMessage], Mapping[str, AttachmentRecord], str | None], TrialRecord
]


def _readers() -> dict[int, Reader]:
    """A reader for each format version ever released; none is ever removed."""
    from logs.record.decode_v1 import decode_record

    return {1: decode_record}


def _format_version(path: Path, messages: Sequence[RawMessage], damage: str | None) -> int:
    if not messages or messages[0].topic != topics.START:
        raise RecordReadError(f"{path} has no start message ({damage or 'not a record'})")
    return v1.TrialStart.FromString(messages[0].data).format_version


def _everything(topic: str) -> bool:
    return True


def _but_images(topic: str) -> bool:
    return not topic.startswith("/camera/") or topic.endswith("/calibration")
