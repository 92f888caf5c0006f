"""Time as a device: the wall's, or one that only moves when something waits."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Protocol

NANOSECONDS = 1_000_000_000


class Clock(Protocol):
    """What waits and what stamps times; injected everywhere, so that no test ever sleeps."""

    def now_ns(self) -> int:
        """Time [ns] since the epoch."""
        ...

    def sleep(self, seconds: float) -> None:
        """Wait."""
        ...


class WallClock:
    """The computer's clock."""

    def now_ns(self) -> int:
        """Time [ns] since the epoch."""
        return time.time_ns()

    def sleep(self, seconds: float) -> None:
        """Wait."""
        time.sleep(max(0.0, seconds))


class SimulatedClock:
    """A clock that moves only when someone waits, and takes the simulated world along.

    Args:
        start_ns: first reading [ns] since the epoch.
    """

    def __init__(self, start_ns: int = 1_700_000_000 * NANOSECONDS) -> None:
        self._now_ns = start_ns
        self._followers: list[Callable[[float], None]] = []

    def now_ns(self) -> int:
        """Time [ns] since the epoch."""
        return self._now_ns

    def sleep(self, seconds: float) -> None:
        """Move on by some time, and everything that follows this clock with it."""
        if seconds <= 0:
            return
        self._now_ns += round(seconds * NANOSECONDS)
        for follower in self._followers:
            follower(seconds)

    def begin_at(self, time_ns: int) -> None:
        """Set the time [ns], before anything happens; it never goes back, and no world follows."""
        self._now_ns = max(self._now_ns, time_ns)

    def follow(self, advance: Callable[[float], None]) -> None:
        """Call `advance(seconds)` whenever time passes."""
        self._followers.append(advance)
