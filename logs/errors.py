"""What can go wrong with a session's files: each message names the file and the way out."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path

from reach.errors import InvalidInputError, ReachError


class LogError(ReachError):
    """Base of every error about recorded sessions."""


class JournalDamagedError(LogError):
    """A line in the middle of the journal cannot be trusted; nothing is read past it."""

    def __init__(self, path: Path, line: int, problem: str) -> None:
        self.path = path
        self.line = line
        self.problem = problem
        super().__init__(
            f"{path}: line {line} {problem}; `reach recover {path.parent}` sets such lines aside"
            " and keeps all others"
        )


class JournalWriteError(LogError):
    """An event could not be put on the disk; it was not acknowledged."""


class SessionLockedError(LogError):
    """Another process is the session's one writer."""


class NotASessionError(InvalidInputError, LogError):
    """The folder is no session, or its session.json cannot be read."""


class SessionExistsError(InvalidInputError, LogError):
    """A session would be created where something is already."""

    def __init__(self, path: Path) -> None:
        super().__init__(
            f"{path} exists already; continue it with --resume, or choose another --out"
        )


class SessionChangedError(LogError):
    """The set-up differs from the one the session was recorded with."""

    def __init__(
        self, changed: Mapping[str, tuple[str | None, str | None]], acceptable: Iterable[str]
    ) -> None:
        self.changed = dict(changed)
        listed = ", ".join(
            f"{name} (was {before or 'absent'}, is {after or 'absent'})"
            for name, (before, after) in sorted(changed.items())
        )
        fixed = sorted(set(changed) - set(acceptable))
        if fixed:
            way_out = f"a session never changes its {', '.join(fixed)}: start a new one"
        else:
            way_out = " ".join(f"--accept-change {name}" for name in sorted(changed))
            way_out = f"put it back, or open a new logged segment with {way_out}"
        super().__init__(f"the set-up changed since the session was recorded: {listed}; {way_out}")


class DiskFullError(LogError):
    """Too little room is left on the session's disk for one more trial."""


class RecordError(LogError):
    """Base of the errors about a trial's record."""


class RecordWriteError(RecordError):
    """The record could not be written: full disk, lost mount, or use after the stop."""


class RecordReadError(RecordError):
    """A file that is no record, or a record without its first message."""


class UnknownFormatError(RecordReadError):
    """A record of a format version that this release does not know."""


class UnknownTrialError(InvalidInputError, RecordError):
    """A trial id that the session does not have."""


class ViewError(RecordError):
    """The Rerun view could not be derived or shown."""


class DatasetError(InvalidInputError, LogError):
    """A labeled data set that cannot be read, joined or written."""
