"""One lock for the session's state, and word of every change to whoever waits or listens."""

from __future__ import annotations

import threading
from collections.abc import Callable
from types import TracebackType


class Changes:
    """A lock that counts what happens under it; entered like a lock, also again by its holder."""

    def __init__(self) -> None:
        self._condition = threading.Condition(threading.RLock())
        self._listening = threading.Lock()
        self._listeners: tuple[Callable[[], None], ...] = ()
        self._version = 0

    def __enter__(self) -> None:
        self._condition.acquire()

    def __exit__(
        self,
        exc_type: type[BaseException] | None,
        exc: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        self._condition.release()

    @property
    def version(self) -> int:
        """Grows with every change."""
        return self._version

    def announce(self) -> None:
        """Tell everyone who waits or listens that something changed."""
        with self._condition:
            self._version += 1
            self._condition.notify_all()
            for listener in self._listeners:
                listener()

    def wait_for(self, condition: Callable[[], bool], timeout: float | None = None) -> None:
        """Wait until a condition holds; looked at now and after every change.

        Args:
            condition: called under the lock.
            timeout: give up after this many seconds.
        """
        with self._condition:
            self._condition.wait_for(condition, timeout)

    def listen(self, listener: Callable[[], None]) -> Callable[[], None]:
        """Call a function after every change, from any thread; returns how to end that."""
        # A lock of its own: whoever comes or goes never waits for the disk.
        with self._listening:
            self._listeners = (*self._listeners, listener)

        def forget() -> None:
            with self._listening:
                self._listeners = tuple(one for one in self._listeners if one is not listener)

        return forget
