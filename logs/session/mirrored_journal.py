"""A journal whose labels also appear as annotation files, without the operator waiting for them."""

from __future__ import annotations

import queue
import threading
from contextlib import suppress

from logs.journal.events import AnyEvent, Entry, Scored
from logs.journal.file import Journal
from logs.session.mirror import AnnotationMirror


class MirroredJournal:
    """Stores events as its journal does; a thread then writes the files of labels and withdrawals.

    A score's file holds more than its event: whoever scored writes it. What cannot be written
    now, or is not because the process dies, recovery writes later.

    Args:
        journal: the truth.
        mirror: writes the files.
    """

    def __init__(self, journal: Journal, mirror: AnnotationMirror) -> None:
        self._journal = journal
        self.mirror = mirror
        self._fresh: queue.Queue[Entry | None] = queue.Queue()
        self._thread = threading.Thread(target=self._run, name="label mirror", daemon=True)
        self._thread.start()

    def append(self, event: AnyEvent) -> Entry:
        """Store an event; its file follows."""
        entry = self._journal.append(event)
        if not isinstance(event, Scored):
            self._fresh.put(entry)
        return entry

    def wait_mirrored(self) -> None:
        """Wait until the files of all events so far are written."""
        self._fresh.join()

    def close(self) -> None:
        """Take no more events, once the files are written; harmless when called twice."""
        self._fresh.put(None)
        self._thread.join()
        self._journal.close()

    def _run(self) -> None:
        while (entry := self._fresh.get()) is not None:
            with suppress(Exception):  # whatever it was: the journal has it, recovery writes it
                self.mirror.note(entry)
            self._fresh.task_done()
