"""Practice: all keys and answers of a session, and nothing is ever stored."""

from __future__ import annotations

import time

from logs.errors import JournalWriteError
from logs.events import AnyEvent, Entry


class MemoryJournal:
    """Takes events like the journal and forgets them with the process."""

    def __init__(self) -> None:
        self._last = 0
        self._open = True

    def append(self, event: AnyEvent) -> Entry:
        """Number an event.

        Raises:
            JournalWriteError: after `close`.
        """
        if not self._open:
            raise JournalWriteError("the practice session was closed")
        self._last += 1
        return Entry(seq=self._last, time_ns=time.time_ns(), event=event)

    def close(self) -> None:
        """Take no more events."""
        self._open = False
