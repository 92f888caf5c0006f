"""Leaving at once: the interpreter does not take the loaded libraries apart first.

That takes about a second of CPU time after a session (physics, meshes, compiled kernels), and an
operator who waits for the prompt sees it as a process that hangs.
"""

from __future__ import annotations

import atexit
import os
import sys
from contextlib import suppress


class QuickExit:
    """Ends the process once everything that was asked for at its end is done.

    Made before anything else registers itself for the end: what is registered first comes last,
    after the threads were waited for and every other such function has run.
    """

    def __init__(self) -> None:
        self.code = 1
        """Of the process; 1 unless set, as after an exception that nobody caught."""
        atexit.register(self._leave)

    def _leave(self) -> None:
        for stream in (sys.stdout, sys.stderr):
            with suppress(OSError, ValueError):  # nobody reads any more
                stream.flush()
        os._exit(self.code)
