"""Opening recordings in the Rerun viewer: on this machine's screen, or in a browser elsewhere."""

from __future__ import annotations

import getpass
import importlib.util
import os
import socket
import subprocess
import sys
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType
from typing import Self
from urllib.parse import quote

from logs.errors import ViewError

LOOPBACK = "127.0.0.1"
WEB_PORT, DATA_PORT = 9090, 9876
"""Rerun's own ports, taken if they are free: then yesterday's ssh line is today's."""
START_SECONDS = 30.0
_ENDED_BY_USER = (0, -2, 130)


def viewer_program() -> str:
    """The viewer itself: its Python starter swallows exit codes, and passes no signal on.

    Raises:
        ViewError: if it is not installed.
    """
    package = importlib.util.find_spec("rerun_cli")
    if package is None or package.origin is None:
        raise ViewError("the Rerun viewer is not installed: pip install rerun-sdk")
    return os.environ.get("RERUN_CLI_PATH") or str(Path(package.origin).with_name("rerun"))


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
            "there is no screen to open the viewer on; --web shows it in a browser elsewhere,"
            " --save FILE.rrd --no-viewer writes a file to open where there is a screen"
        )
    # Its own server stays on this machine, and on a port that no other viewer has.
    process = _start(["--bind", LOOPBACK, "--port", "auto"], paths, env)
    try:
        code = process.wait()
    except KeyboardInterrupt:
        code = process.wait()
    if code not in _ENDED_BY_USER:
        raise ViewError(f"the Rerun viewer ended with code {code}; --web shows it in a browser")


@dataclass(frozen=True, slots=True)
class WebAddress:
    """Where a browser finds the recordings.

    Args:
        page: port of the viewer's page.
        data: port of the recordings.
    """

    page: int
    data: int

    @property
    def link(self) -> str:
        """For a browser on this machine, or beyond the tunnel on any other."""
        source = quote(f"rerun+http://{LOOPBACK}:{self.data}/proxy", safe="")
        return f"http://{LOOPBACK}:{self.page}/?url={source}"

    def tunnel(self, environment: Mapping[str, str]) -> str:
        """The ssh line that brings both ports to another machine.

        Args:
            environment: of this process; in an SSH session it tells how this machine was reached.
        """
        reached = environment.get("SSH_CONNECTION", "").split()
        host, port = reached[2:] if len(reached) == 4 else (socket.gethostname(), "22")
        other_port = "" if port == "22" else f" -p {port}"
        ports = " ".join(f"-L {one}:{LOOPBACK}:{one}" for one in (self.page, self.data))
        return f"ssh -N {ports}{other_port} {getpass.getuser()}@{host}"


class WebViewer:
    """Serves recordings to browsers, on this machine's loopback alone; a context manager.

    The page is part of the installed viewer: no other server is asked for anything it needs.

    Args:
        paths: .rrd files; the first is shown.
        usual_ports: take Rerun's own ports if they are free; otherwise any.

    Raises:
        ViewError: if the server does not start.
    """

    def __init__(self, paths: Sequence[Path], *, usual_ports: bool = True) -> None:
        wanted = (WEB_PORT, DATA_PORT) if usual_ports else (0, 0)
        self.address = WebAddress(*map(_free_port, wanted))
        where = ["--serve-web", "--bind", LOOPBACK]
        where += ["--web-viewer-port", str(self.address.page), "--port", str(self.address.data)]
        self._process = _start(where, paths, dict(os.environ), quiet=True)
        try:
            self._await_ports()
        except BaseException:
            self.close()
            raise

    def wait(self) -> None:
        """Serve until interrupted.

        Raises:
            ViewError: if the server ends by itself.
        """
        try:
            code = self._process.wait()
        except KeyboardInterrupt:
            return
        if code not in _ENDED_BY_USER:
            raise ViewError(f"the Rerun viewer's server ended with code {code}")

    def close(self) -> None:
        """End the server."""
        self._process.terminate()
        self._process.wait()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.close()

    def _await_ports(self) -> None:
        end = time.monotonic() + START_SECONDS
        while not all(_answers(port) for port in (self.address.page, self.address.data)):
            if self._process.poll() is not None:
                code = self._process.returncode
                raise ViewError(f"the Rerun viewer's server does not start: it ended, code {code}")
            if time.monotonic() > end:
                raise ViewError(f"the Rerun viewer's server does not answer in {START_SECONDS} s")
            time.sleep(0.05)


def _start(
    options: Sequence[str], paths: Sequence[Path], env: Mapping[str, str], *, quiet: bool = False
) -> subprocess.Popen[bytes]:
    command = [viewer_program(), *options, *map(str, paths)]
    out = subprocess.DEVNULL if quiet else None
    try:
        return subprocess.Popen(command, env=dict(env), stdout=out, stderr=out)
    except OSError as error:
        raise ViewError(f"the Rerun viewer does not start: {error}") from error


def _free_port(wanted: int) -> int:
    """The wanted port if nobody has it, else any."""
    for port in (wanted, 0):
        try:
            with socket.create_server((LOOPBACK, port)) as probe:
                found: int = probe.getsockname()[1]
                return found
        except OSError:
            continue
    raise ViewError(f"no free port on {LOOPBACK}")


def _answers(port: int) -> bool:
    try:
        with socket.create_connection((LOOPBACK, port), timeout=1.0):
            return True
    except OSError:
        return False
