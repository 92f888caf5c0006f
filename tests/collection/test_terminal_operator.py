"""`reach collect --operator terminal` in a real pseudo-terminal."""

from __future__ import annotations

import fcntl
import os
import re
import select
import signal
import struct
import subprocess
import sys
import termios
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from logs.session.folder import SessionFolder

REACH = Path(sys.executable).with_name("reach")
COMMAND = [
    "collect", "--objects", "cube_3cm", "--grasps", "2", "--repeats", "1", "--seed", "3",
    "--operator", "terminal", "--no-report", "--out",
]  # fmt: skip
ESCAPES = re.compile(
    rb"\x1b(\[[0-9;?<>=]*[a-zA-Z]|\][^\x07\x1b]*(\x07|\x1b\\)|[()][A-Z0-9]|[=>78M])"
)
PATIENCE = 250.0


class Terminal:
    """A terminal with a program in it: type keys, read what is on the screen."""

    def __init__(self, *arguments: str) -> None:
        self._keys, inside = os.openpty()
        fcntl.ioctl(inside, termios.TIOCSWINSZ, struct.pack("HHHH", 45, 140, 0, 0))
        self.process = subprocess.Popen(
            [REACH, *arguments], stdin=inside, stdout=inside, stderr=inside,
            env={**os.environ, "TERM": "xterm-256color"}, start_new_session=True,
        )  # fmt: skip
        os.close(inside)
        self._written = b""

    def type(self, keys: str) -> None:
        os.write(self._keys, keys.encode())

    def read(self) -> str:
        """What was written since the last `until`, without its escapes."""
        while select.select([self._keys], [], [], 0.05)[0]:
            try:
                self._written += os.read(self._keys, 65536)
            except OSError:  # the program has left
                break
        return ESCAPES.sub(b"", self._written).decode(errors="replace")

    def until(self, condition: Callable[[str], bool] | str) -> None:
        """Wait for a text, or for a condition; then forget what was written."""
        deadline = time.monotonic() + PATIENCE
        while True:
            seen = self.read()
            if condition in seen if isinstance(condition, str) else condition(seen):
                self._written = b""
                return
            assert time.monotonic() < deadline, seen[-2000:]
            assert self.process.poll() is None, seen[-2000:]

    def close(self) -> None:
        if self.process.poll() is None:
            self.process.kill()
        self.process.wait()
        os.close(self._keys)


@pytest.fixture
def start() -> Iterator[Callable[..., Terminal]]:
    started: list[Terminal] = []

    def begin(*arguments: str) -> Terminal:
        started.append(Terminal(*arguments))
        return started[-1]

    yield begin
    for terminal in started:
        terminal.close()


def test_without_a_terminal_it_is_refused_in_one_line(tmp_path: Path) -> None:
    done = subprocess.run(
        [REACH, *COMMAND, str(tmp_path / "S")],
        stdin=subprocess.DEVNULL, capture_output=True, text=True,
    )  # fmt: skip
    assert done.returncode == 2
    assert len(done.stderr.splitlines()) == 1 and "needs a terminal" in done.stderr
    assert not (tmp_path / "S").exists()


@pytest.mark.slow
def test_a_trial_is_labeled_and_leaving_the_console_pauses(
    start: Callable[..., Terminal], tmp_path: Path
) -> None:
    out = tmp_path / "S"
    terminal = start(*COMMAND, str(out))
    terminal.until("Place: cube_3cm")
    terminal.type("\r")
    terminal.until("Was it stably lifted?")
    terminal.type("s")
    terminal.until("stored: trial 1: success")
    terminal.type("\x11")  # ctrl+q
    terminal.until("Enter opens the console again")
    assert SessionFolder.open(out).read_state().paused
    assert terminal.process.poll() is None
    terminal.type("\r")
    terminal.until("1 of 2 labeled")
    terminal.type("p")
    terminal.until(lambda _: not SessionFolder.open(out).read_state().paused)
    terminal.type("\x11")
    terminal.until("Enter opens the console again")
    os.kill(terminal.process.pid, signal.SIGINT)
    deadline = time.monotonic() + 60
    while terminal.process.poll() is None:
        terminal.read()
        assert time.monotonic() < deadline
    assert terminal.process.returncode == 0
    state = SessionFolder.open(out).read_state()
    assert state.counts().labelled == 1
    assert state.closed is not None and state.closed.status == "ended"
