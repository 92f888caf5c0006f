"""The journal: an append-only file of events, the truth about a session's trials and labels.

One line per event, `{"crc":"89abcdef","seq":7,"time_ns":...,"event":{...}}`. The CRC-32 covers
all bytes after its comma up to the line's end. A line is on the disk (fsync) before it is
acknowledged. A kill can only tear the last line: it has no line end, was never acknowledged,
and is set aside in `events.torn`. Any other bad line refuses to be read.
"""

from __future__ import annotations

import os
import time
import zlib
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType
from typing import Self

from pydantic import ValidationError

from logs.errors import JournalDamagedError, JournalWriteError
from logs.journal.events import AnyEvent, Entry, JournalRepaired
from logs.journal.lock import SessionLock

JOURNAL_NAME = "events.jsonl"
TORN_NAME = "events.torn"
_PREFIX = b'{"crc":"'
_BODY = len(b'{"crc":"89abcdef",')


@dataclass(frozen=True, slots=True, eq=False)
class JournalLine:
    """One complete line: its entry, or what is wrong with it.

    Args:
        number: counted from 1.
        raw: the bytes without the line end.
    """

    number: int
    raw: bytes
    entry: Entry | None
    problem: str | None


@dataclass(frozen=True, slots=True, eq=False)
class JournalScan:
    """All that a journal file holds, trusted or not; `torn` is an unfinished last line."""

    lines: tuple[JournalLine, ...]
    torn: bytes

    @property
    def entries(self) -> tuple[Entry, ...]:
        """The entries of the good lines."""
        return tuple(line.entry for line in self.lines if line.entry is not None)

    @property
    def bad(self) -> tuple[JournalLine, ...]:
        """The lines that cannot be trusted."""
        return tuple(line for line in self.lines if line.entry is None)


def encode_entry(entry: Entry) -> bytes:
    """One journal line, with its line end."""
    body = entry.model_dump_json().encode()[1:]
    return _PREFIX + f'{zlib.crc32(body):08x}",'.encode() + body + b"\n"


def _decode(number: int, raw: bytes, after: int) -> JournalLine:
    body = raw[_BODY:]
    if raw != _PREFIX + f'{zlib.crc32(body):08x}",'.encode() + body:
        return JournalLine(number, raw, None, "does not match its checksum")
    try:
        entry = Entry.model_validate_json(b"{" + body)
    except ValidationError as error:
        first = error.errors()[0]
        where = ".".join(map(str, first["loc"]))
        return JournalLine(number, raw, None, f"holds no known event ({where}: {first['msg']})")
    if entry.seq <= after:
        return JournalLine(number, raw, None, f"repeats number {entry.seq} after {after}")
    return JournalLine(number, raw, entry, None)


def scan_journal(path: Path) -> JournalScan:
    """Read every line without refusing any: what recovery starts from."""
    return scan_lines(path.read_bytes())


def scan_lines(content: bytes) -> JournalScan:
    """A journal's lines, or some of them in their order, without refusing any."""
    *complete, torn = content.split(b"\n")
    lines: list[JournalLine] = []
    after = 0
    for number, raw in enumerate(complete, start=1):
        line = _decode(number, raw, after)
        after = line.entry.seq if line.entry else after
        lines.append(line)
    return JournalScan(tuple(lines), torn)


def _refuse_damage(path: Path, scan: JournalScan) -> None:
    for line in scan.bad:
        raise JournalDamagedError(path, line.number, str(line.problem))
    known_lost = {
        seq
        for entry in scan.entries
        if isinstance(entry.event, JournalRepaired)
        for seq in entry.event.lost
    }
    expected = 1
    for line, entry in zip(scan.lines, scan.entries, strict=True):
        missing = set(range(expected, entry.seq)) - known_lost
        if missing:
            problem = f"follows a gap: events {sorted(missing)} are missing"
            raise JournalDamagedError(path, line.number, problem)
        expected = entry.seq + 1


def read_journal(path: Path) -> tuple[Entry, ...]:
    """The journal's entries; an unfinished last line (a writer at work) is left out.

    Raises:
        JournalDamagedError: if a complete line is bad or missing.
    """
    scan = scan_journal(path)
    _refuse_damage(path, scan)
    return scan.entries


class Journal:
    """The session's one writer of events; a context manager.

    Args:
        path: the journal file; it exists.
        clock: nanoseconds since the epoch.
        fsync: how a descriptor's data reach the disk; tests inject failures here.

    Raises:
        SessionLockedError: if another process writes.
        JournalDamagedError: if a line in the middle is bad.
    """

    def __init__(
        self,
        path: Path,
        *,
        clock: Callable[[], int] = time.time_ns,
        fsync: Callable[[int], None] = os.fsync,
    ) -> None:
        self.path = path
        self._clock = clock
        self._fsync = fsync
        self._broken: str | None = None
        self._lock = SessionLock(path.parent)
        try:
            scan = scan_journal(path)
            _refuse_damage(path, scan)
            self._descriptor = os.open(path, os.O_RDWR | os.O_APPEND | os.O_CLOEXEC)
        except BaseException:
            self._lock.release()
            raise
        self.entries: tuple[Entry, ...] = scan.entries
        self._last = scan.entries[-1].seq if scan.entries else 0
        if scan.torn:
            self._set_aside(scan.torn)

    def append(self, event: AnyEvent) -> Entry:
        """Write an event and return it once it is on the disk.

        Raises:
            JournalWriteError: if it is not; then nothing of it stays in the file.
        """
        if self._broken is not None:
            raise JournalWriteError(f"{self.path} is closed to writing: {self._broken}")
        entry = Entry(seq=self._last + 1, time_ns=self._clock(), event=event)
        self._write(encode_entry(entry))
        self._last = entry.seq
        return entry

    def close(self) -> None:
        """Close the file and let another writer in; harmless when called twice."""
        if self._descriptor >= 0:
            os.close(self._descriptor)
            self._descriptor = -1
            self._broken = "the session was closed"
        self._lock.release()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        exc_type: type[BaseException] | None,
        exc: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        self.close()

    def _write(self, line: bytes) -> None:
        size = os.fstat(self._descriptor).st_size
        synced = False
        try:
            written = os.write(self._descriptor, line)
            if written != len(line):
                raise OSError(f"only {written} of {len(line)} bytes fit on the disk")
            synced = True
            self._fsync(self._descriptor)
        except OSError as error:
            if synced:
                # After a failed fsync the kernel may have dropped the pages: nothing later can
                # be promised either, until the journal is opened and read again.
                self._broken = f"an earlier event could not be stored ({error})"
            self._take_back(size)
            raise JournalWriteError(f"{self.path}: the event was not stored: {error}") from error

    def _take_back(self, size: int) -> None:
        try:
            os.ftruncate(self._descriptor, size)
            os.fsync(self._descriptor)
        except OSError as error:
            self._broken = f"an unfinished line could not be taken back ({error})"

    def _set_aside(self, torn: bytes) -> None:
        with (self.path.parent / TORN_NAME).open("ab") as stream:
            stream.write(torn + b"\n")
            stream.flush()
            os.fsync(stream.fileno())
        size = os.fstat(self._descriptor).st_size
        os.ftruncate(self._descriptor, size - len(torn))
        os.fsync(self._descriptor)
