"""Is anybody there? Without a console the session holds: a robot nobody watches starts nothing."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from typing import Final

from labeling.control.controller import SessionController, uptime
from logs.errors import JournalWriteError

CAUSE: Final = "console"
SILENCE_LIMIT: Final = 5.0
"""Seconds without a sign of life from any console before the session holds."""


class Presence:
    """Holds the session while no console gives a sign of life.

    A sign of life is a request, not an open socket: a tablet that left the network keeps its
    socket for minutes.

    Args:
        controller: what to hold.
        clock: seconds, monotonic.
    """

    def __init__(
        self, controller: SessionController, *, clock: Callable[[], float] = uptime
    ) -> None:
        self._controller = controller
        self._clock = clock
        self._seen: float | None = None

    def alive(self) -> None:
        """A console gave a sign of life."""
        self._seen = self._clock()

    def check(self) -> None:
        """Hold or release, by the time since the last sign of life."""
        silent = self._seen is None or self._clock() - self._seen > SILENCE_LIMIT
        try:
            if silent:
                self._controller.hold(CAUSE, "no console is connected")
            else:
                self._controller.release(CAUSE)
        except JournalWriteError:
            return  # the session's loop meets the same error and reports it

    async def watch(self, period: float = 0.25) -> None:
        """Check until cancelled."""
        while True:
            await asyncio.to_thread(self.check)
            await asyncio.sleep(period)
