"""Recordings for the embedded view, each behind a short-lived ticket."""

from __future__ import annotations

import secrets
import threading
import time
from collections.abc import Callable
from pathlib import Path
from typing import Final

from labeling.errors import OutsideSessionError

TICKET_SECONDS: Final = 60.0


class RecordingTickets:
    """Hands out tickets for recordings inside the session's folder; thread-safe.

    The view lives on another site and has no token: a ticket opens one recording for a minute.

    Args:
        root: the session's folder.
        clock: seconds, monotonic.
    """

    def __init__(self, root: Path, *, clock: Callable[[], float] = time.monotonic) -> None:
        self._root = root.resolve()
        self._clock = clock
        self._lock = threading.Lock()
        self._tickets: dict[str, tuple[Path, float]] = {}

    def issue(self, path: Path) -> str:
        """A new ticket for a recording.

        Raises:
            OutsideSessionError: if the path is not a recording inside the session's folder.
        """
        resolved = path.resolve()
        if not resolved.is_relative_to(self._root) or resolved.suffix != ".rrd":
            raise OutsideSessionError(f"{path} is no recording of this session")
        ticket = secrets.token_urlsafe(24)
        now = self._clock()
        with self._lock:
            self._tickets = {t: pair for t, pair in self._tickets.items() if pair[1] > now}
            self._tickets[ticket] = (resolved, now + TICKET_SECONDS)
        return ticket

    def redeem(self, ticket: str) -> Path | None:
        """The recording of a valid ticket."""
        with self._lock:
            path, until = self._tickets.get(ticket, (None, 0.0))
        return path if self._clock() < until else None
