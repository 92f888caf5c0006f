"""The Rerun web viewer's two files, taken once from the installed package.

They ship inside the `rerun` program (43 MB) and are fetched from it over the loopback, so that
the embedded view works without a network. They are kept in the cache by version.
"""

from __future__ import annotations

import os
import tempfile
from importlib.metadata import version
from pathlib import Path
from typing import Final

import httpx

from labeling.errors import LabelingError
from logs.errors import ViewError
from logs.view.viewer import LOOPBACK, WebViewer
from reach.cache import cache_folder

ASSETS: Final = {
    "re_viewer.js": "text/javascript",
    "re_viewer_bg.wasm": "application/wasm",
}
ANSWER_SECONDS: Final = 20.0


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
    try:
        with WebViewer([], usual_ports=False) as viewer:
            for name in ASSETS:
                _fetch(f"http://{LOOPBACK}:{viewer.address.page}/{name}", folder / name)
    except (ViewError, httpx.HTTPError) as error:
        raise ViewerAssetsError(f"the rerun viewer cannot be embedded: {error}") from error


def _fetch(url: str, path: Path) -> None:
    answer = httpx.get(url, timeout=ANSWER_SECONDS, trust_env=False).raise_for_status()
    handle, temporary = tempfile.mkstemp(dir=path.parent, suffix=".part")
    with os.fdopen(handle, "wb") as stream:
        stream.write(answer.content)
    os.replace(temporary, path)
