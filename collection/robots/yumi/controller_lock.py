"""One leader per arm: two programs that write the same requests would break each other's motions."""

from __future__ import annotations

import hashlib
import tempfile
from pathlib import Path

from collection.errors import ControllerTakenError
from logs.exclusive import ExclusiveFile, HeldError


class ControllerLock:
    """The right to lead one arm's program, among the processes of this computer.

    Args:
        url: of the controller.
        task: the arm's RAPID task.

    Raises:
        ControllerTakenError: another process, or another link in this one, leads it.
    """

    def __init__(self, url: str, task: str) -> None:
        key = hashlib.sha256(f"{url} {task}".encode()).hexdigest()[:16]
        try:
            self._file = ExclusiveFile(Path(tempfile.gettempdir()) / f"reach-yumi-{key}.lock")
        except HeldError as error:
            raise ControllerTakenError(
                f"{task} at {url} is led by process {error.holder} of this computer: end that first"
            ) from error

    def release(self) -> None:
        """Let another one lead; harmless when called twice."""
        self._file.release()
