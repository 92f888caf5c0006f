"""The operator's stop: it stands until a person releases it, whatever motion code does meanwhile."""

from __future__ import annotations

from collection.errors import StoppedError

STOPPED = "stopped by the operator; nothing moves until the stop is cleared"


class StopLatch:
    """One robot's standing stop, shared by its arm and its hand.

    A plain flag: any thread may press it, and a signal handler, too, without waiting for a lock.
    """

    def __init__(self) -> None:
        self._stands = False

    def press(self) -> None:
        """Stop for good; harmless when it stands already."""
        self._stands = True

    def release(self) -> None:
        """Let the robot follow again; only on the word of the person who stopped it."""
        self._stands = False

    @property
    def stands(self) -> bool:
        """Whether the robot must not move."""
        return self._stands

    def refuse(self) -> None:
        """Refuse a command while the stop stands.

        Raises:
            StoppedError: it does.
        """
        if self.stands:
            raise StoppedError(STOPPED)
