"""How many more trials the session's disk can take: warn first, then start no new one."""

from __future__ import annotations

from collections.abc import Callable

from logs.errors import DiskFullError


class DiskGuard:
    """Watches the room on the session's disk.

    Args:
        trials_left: how many more trials fit; None if nobody needs to know.
        minimum: fewer than this many end the session.
        warning: fewer than this many are shown as a warning.
    """

    def __init__(
        self, trials_left: Callable[[], int] | None, *, minimum: int = 2, warning: int = 50
    ) -> None:
        self._trials_left = trials_left
        self._minimum = minimum
        self._warning = warning
        self.left = trials_left() if trials_left else None

    @property
    def low(self) -> bool:
        """True if the operator should make room."""
        return self.left is not None and self.left < self._warning

    def require_room(self) -> None:
        """Look again before a trial begins.

        Raises:
            DiskFullError: if the next trial may not fit.
        """
        if self._trials_left is None:
            return
        self.left = self._trials_left()
        if self.left < self._minimum:
            raise DiskFullError(
                f"room for {self.left} more trials is left on the session's disk, fewer than"
                f" {self._minimum}: free some, then continue with --resume"
            )
