"""A thread that writes one file, so that nobody else waits for the disk."""

from __future__ import annotations

import queue
import threading
from collections.abc import Callable
from typing import NamedTuple

from google.protobuf.message import Message

from logs.errors import RecordWriteError
from logs.record.mcap_file import DurableMcap

Job = Callable[[DurableMcap], None]


class _Item(NamedTuple):
    size: int
    job: Job
    barrier: bool = False


class BackgroundWriter:
    """Runs jobs on a file, in order, in a thread of its own.

    After the first job that fails no other runs: the file keeps what was flushed before.

    Args:
        file: the file; only this thread touches it until `close` returns.
        backlog_limit: how many bytes may wait; see `fits`.
    """

    def __init__(self, file: DurableMcap, backlog_limit: int) -> None:
        self._file = file
        self._limit = backlog_limit
        self._backlog = 0
        self._lock = threading.Lock()
        self._items: queue.SimpleQueue[_Item | None] = queue.SimpleQueue()
        self._thread = threading.Thread(target=self._run, name="record-writer", daemon=True)
        self.failure: Exception | None = None
        self._closed = False
        self._thread.start()

    def fits(self, size: int) -> bool:
        """Whether a job of that many bytes may be added without exceeding the limit."""
        return self._backlog + size <= self._limit

    def add(self, job: Job, size: int = 0) -> None:
        """Queue a job; never waits."""
        if self._closed:
            raise RecordWriteError(f"the record {self._file.path} is stopped; it takes no more")
        with self._lock:
            self._backlog += size
        self._items.put(_Item(size, job))

    def add_message(
        self,
        topic: str,
        message: Callable[[], Message],
        capture_ns: int,
        receive_ns: int,
        size: int,
    ) -> None:
        """Queue a message, which is built in this thread."""
        self.add(
            lambda file: file.message(
                topic, message(), capture_ns=capture_ns, receive_ns=receive_ns
            ),
            size,
        )

    def wait(self, timeout: float | None) -> None:
        """Wait until all jobs so far ran and are durable.

        Raises:
            RecordWriteError: if a job failed, or time ran out [s].
        """
        self.add(DurableMcap.flush)
        done = threading.Event()
        self._items.put(_Item(0, lambda _file: done.set(), barrier=True))
        if not done.wait(timeout):
            raise RecordWriteError(f"the disk of {self._file.part} did not keep up for {timeout} s")
        self.refuse_failed()

    def close(self) -> None:
        """Run what is queued and end the thread."""
        self._closed = True
        self._items.put(None)
        self._thread.join()

    def refuse_failed(self) -> None:
        """Raise what the thread met.

        Raises:
            RecordWriteError: if a job failed.
        """
        if self.failure is not None:
            raise RecordWriteError(
                f"cannot write {self._file.part}: {self.failure}; what was flushed stays there"
            ) from self.failure

    def _run(self) -> None:
        while (item := self._items.get()) is not None:
            if self.failure is None or item.barrier:
                try:
                    item.job(self._file)
                except Exception as error:  # told to the trial at its next safe point
                    self.failure = error
            with self._lock:
                self._backlog -= item.size
