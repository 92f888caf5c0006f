"""Opening recordings in the Rerun viewer, on this machine's screen."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path

from logs.errors import ViewError


def show_recordings(paths: Sequence[Path], environment: Mapping[str, str] | None = None) -> None:
    """Open recordings and wait until the viewer is closed.

    Args:
        paths: .rrd files; the first is shown.
        environment: instead of this process's own.

    Raises:
        ViewError: if there is no screen, or the viewer does not start.
    """
    env = dict(os.environ if environment is None else environment)
    if sys.platform == "linux" and not (env.get("DISPLAY") or env.get("WAYLAND_DISPLAY")):
        raise ViewError(
            "there is no screen to open the viewer on; use --no-viewer, or --save FILE.rrd and"
            " open the file where there is one"
        )
    # Its own server stays on this machine, and on a port that no other viewer has.
    command = [sys.executable, "-m", "rerun_cli", "--bind", "127.0.0.1", "--port", "auto"]
    command += [str(path) for path in paths]
    try:
        finished = subprocess.run(command, env=env, check=False)
    except OSError as error:
        raise ViewError(f"the Rerun viewer does not start: {error}") from error
    if finished.returncode not in (0, -2, 130):
        raise ViewError(f"the Rerun viewer ended with code {finished.returncode}")
