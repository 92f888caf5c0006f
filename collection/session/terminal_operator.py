"""`--operator terminal`: the console in the very terminal that the session was started from.

The session's loop runs in a thread; this one belongs to the screen and the keys. Quitting the
console pauses the session: a robot is never left working for nobody.
"""

from __future__ import annotations

import select
import sys
import threading
from collections import deque
from collections.abc import Callable
from typing import TYPE_CHECKING

from labeling.control.commands import Actor, Command, CommandKind

if TYPE_CHECKING:
    from collection.session.progress import SessionProgress
    from labeling.control.controller import SessionController

LOOK_PERIOD = 0.2
"""Seconds between looks at whether the session has ended, while the console is closed."""


def has_terminal() -> bool:
    """Whether this process has a screen and keys of its own."""
    streams = (sys.__stdin__, sys.__stdout__, sys.__stderr__)
    return all(stream is not None and stream.isatty() for stream in streams)


class TerminalOperator:
    """Leads a session from its own terminal.

    Args:
        controller: the session's writer.
        person: at the terminal.
        link: of the console's server.
        progress: shares the terminal; its lines go into the console while that is open.
    """

    def __init__(
        self,
        controller: SessionController,
        person: Actor,
        link: str,
        progress: SessionProgress,
    ) -> None:
        self._controller = controller
        self._person = person
        self._link = link
        self._progress = progress
        self._lines: deque[str] = deque(maxlen=100)
        self._trouble: list[BaseException] = []

    def lead(self, loop: Callable[[], None]) -> None:
        """Run the session's loop beside the console, until the loop ends.

        Args:
            loop: ends by itself once the session is over or asked to end.

        Raises:
            BaseException: whatever the loop raised.
        """
        session = threading.Thread(target=self._run, args=(loop,), name="session")
        session.start()
        try:
            while session.is_alive():
                self._show(session)
                if session.is_alive():
                    self._pause(session)
        finally:
            if session.is_alive():
                self._controller.request_end()
            session.join()
        if self._trouble:
            raise self._trouble[0]

    def _run(self, loop: Callable[[], None]) -> None:
        try:
            loop()
        except BaseException as error:  # raised again by `lead`, once the screen is ours
            self._trouble.append(error)

    def _show(self, session: threading.Thread) -> None:
        """The console, until its operator quits or the session is over."""
        from labeling.terminal.app import TerminalConsole
        from labeling.terminal.link import TerminalLink

        with self._progress.elsewhere(self._lines.append):
            TerminalConsole(
                TerminalLink(self._link), lines=self._lines, over=lambda: not session.is_alive()
            ).run()

    def _pause(self, session: threading.Thread) -> None:
        """Nothing new starts while nobody looks; Enter opens the console again."""
        self._controller.submit(Command(kind=CommandKind.PAUSE), self._person)
        self._progress.say("paused; Enter opens the console again, Ctrl-C ends the session")
        while session.is_alive() and not self._controller.ending:
            if select.select([sys.stdin], [], [], LOOK_PERIOD)[0]:
                if not sys.stdin.readline():  # the terminal is gone
                    self._controller.request_end()
                return
