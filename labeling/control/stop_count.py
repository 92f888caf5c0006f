"""Stops that have acted upon the robot and are not in the journal yet."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager


class StopCount:
    """How many stops are being pressed right now.

    A stop acts at once, and is decided and stored later, when the session's lock is free. Until
    then the stored state says nothing of it, and clearing an earlier stop must not take it back.
    """

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._count = 0

    @contextmanager
    def pressed(self) -> Iterator[None]:
        """While a stop acts and is stored."""
        with self._lock:
            self._count += 1
        try:
            yield
        finally:
            with self._lock:
                self._count -= 1

    @property
    def under_way(self) -> bool:
        """Whether a stop acts that is not stored yet."""
        return self._count > 0

    def unless_pressed(self, release: Callable[[], None]) -> None:
        """Release the robot, unless another stop has acted meanwhile: that one is to be cleared."""
        with self._lock:
            if self._count == 0:
                release()
