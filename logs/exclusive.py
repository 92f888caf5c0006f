"""A file that one process at a time holds: an advisory lock that the kernel drops with its holder."""

from __future__ import annotations

import fcntl
import os
from pathlib import Path


class HeldError(OSError):
    """Somebody holds the file.

    Args:
        holder: what the holder wrote into it: its process id, or nothing.
    """

    def __init__(self, holder: str) -> None:
        super().__init__(f"held by process {holder or 'unknown'}")
        self.holder = holder or "unknown"


class ExclusiveFile:
    """Holds a file until released; the file stays, with the last holder's process id in it.

    Args:
        path: is made if it does not exist; a file of another user serves as well, unwritten.

    Raises:
        HeldError: another process, or another object in this one, holds it.
        OSError: it can be neither made nor opened.
    """

    def __init__(self, path: Path) -> None:
        writable = True
        try:
            self._descriptor = os.open(path, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o644)
        except PermissionError:
            if not path.exists():
                raise
            writable = False
            self._descriptor = os.open(path, os.O_RDONLY | os.O_CLOEXEC)
        try:
            fcntl.flock(self._descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError as error:
            holder = os.pread(self._descriptor, 32, 0).decode(errors="replace").strip()
            os.close(self._descriptor)
            raise HeldError(holder) from error
        if writable:
            os.ftruncate(self._descriptor, 0)
            os.pwrite(self._descriptor, str(os.getpid()).encode(), 0)

    def release(self) -> None:
        """Let another one in; harmless when called twice."""
        if self._descriptor >= 0:
            os.close(self._descriptor)
            self._descriptor = -1
