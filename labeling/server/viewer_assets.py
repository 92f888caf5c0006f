"""The Rerun web viewer's two files, taken once from the installed package.

They ship inside the `rerun` program (43 MB) and are fetched from it over the loopback, so that
the embedded view works without a network. They are kept in the cache by version.
"""

from __future__ import annotations

import os
import socket
import subprocess
import tempfile
import time
from importlib.metadata import version
from pathlib import Path
from typing import Final

import httpx

from labeling.errors import LabelingError
from logs.errors import ViewError
from logs.view.viewer import viewer_program
from reach.cache import cache_folder

ASSETS: Final = {
    "re_viewer.js": "text/javascript",
    "re_viewer_bg.wasm": "application/wasm",
}
START_SECONDS: Final = 20.0


class ViewerAssetsError(LabelingError):
    """The embedded view cannot be had; everything else works without it."""


def viewer_asset(name: str) -> Path:
    """Path of one of the viewer's files, fetching both the first time.

    Raises:
        ViewerAssetsError: if the installed `rerun` does not hand them out.
    """
    folder = cache_folder() / f"rerun-viewer-{version('rerun-sdk')}"
    if not (folder / name).exists():
        _fetch_into(folder)
    return folder / name


def _fetch_into(folder: Path) -> None:
    folder.mkdir(parents=True, exist_ok=True)
    web_port, grpc_port = _free_ports(2)
    try:
        command = [viewer_program(), "--serve-web", "--bind", "127.0.0.1"]
    except ViewError as error:
        raise ViewerAssetsError(f"the rerun viewer cannot be embedded: {error}") from error
    command += ["--web-viewer-port", str(web_port), "--port", str(grpc_port)]
    quiet = subprocess.DEVNULL
    with subprocess.Popen(command, stdin=quiet, stdout=quiet, stderr=quiet) as program:
        try:
            for name in ASSETS:
                _fetch(f"http://127.0.0.1:{web_port}/{name}", folder / name, program)
        finally:
            program.terminate()


def _fetch(url: str, path: Path, program: subprocess.Popen[bytes]) -> None:
    deadline = time.monotonic() + START_SECONDS
    while True:
        try:
            answer = httpx.get(url, timeout=START_SECONDS, trust_env=False).raise_for_status()
            break
        except httpx.HTTPError as error:
            if program.poll() is not None or time.monotonic() > deadline:
                raise ViewerAssetsError(f"the rerun viewer cannot be embedded: {error}") from error
            time.sleep(0.05)
    handle, temporary = tempfile.mkstemp(dir=path.parent, suffix=".part")
    with os.fdopen(handle, "wb") as stream:
        stream.write(answer.content)
    os.replace(temporary, path)


def _free_ports(count: int) -> list[int]:
    sockets = [socket.create_server(("127.0.0.1", 0)) for _ in range(count)]
    ports = [opened.getsockname()[1] for opened in sockets]
    for opened in sockets:
        opened.close()
    return ports
