"""One writer per session."""

from __future__ import annotations

from pathlib import Path
from types import TracebackType
from typing import Self

from logs.errors import SessionLockedError
from logs.exclusive import ExclusiveFile, HeldError

LOCK_NAME = "writer.lock"


class SessionLock:
    """The right to write to a session's folder; a context manager.

    The lock lies on a file of its own, because recovery replaces the journal by a rename.

    Raises:
        SessionLockedError: if another process (or another lock in this one) holds it.
    """

    def __init__(self, folder: Path) -> None:
        try:
            self._file = ExclusiveFile(folder / LOCK_NAME)
        except HeldError as error:
            raise SessionLockedError(
                f"{folder} is being written by process {error.holder};"
                " end that session, or use its console"
            ) from error

    def release(self) -> None:
        """Let another writer in; harmless when called twice."""
        self._file.release()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        exc_type: type[BaseException] | None,
        exc: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        self.release()
