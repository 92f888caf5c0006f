"""A command's process ends at once, and only after everything that belongs to its end."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
SCRIPT = """
import atexit, sys, threading, time
from collection.cli.leaving import QuickExit
leaving = QuickExit()
atexit.register(lambda: print("registered"))
threading.Thread(target=lambda: (time.sleep(0.2), print("thread"))).start()
class Library:
    def __del__(self):
        print("taken apart")
kept = sys.kept = Library()
{ending}
"""


@pytest.mark.parametrize(
    ("ending", "code", "said"),
    [
        ("leaving.code = 3; sys.exit(leaving.code)", 3, ""),
        ("leaving.code = 0", 0, ""),
        ("raise ValueError('a fault')", 1, "ValueError: a fault"),
    ],
)
def test_threads_and_exit_functions_finish_and_libraries_are_left_alone(
    ending: str, code: int, said: str
) -> None:
    done = subprocess.run(
        [sys.executable, "-c", SCRIPT.format(ending=ending)],
        cwd=ROOT,
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
    )
    assert (done.returncode, done.stdout.split("\n")[:-1]) == (code, ["thread", "registered"])
    assert said in done.stderr


def test_a_reader_that_has_seen_enough_is_no_error() -> None:
    script = "from collection.cli.leaving import QuickExit; QuickExit().code = 0; print('x')"
    buffered = {name: value for name, value in os.environ.items() if name != "PYTHONUNBUFFERED"}
    with subprocess.Popen(
        [sys.executable, "-c", script],
        cwd=ROOT,
        env=buffered,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
    ) as process:
        assert process.stdout is not None and process.stderr is not None
        process.stdout.close()
        complaint = process.stderr.read()
    assert (process.returncode, complaint) == (0, b"")
