"""Pictures for the console: how to place the object, where it was found.

A picture is a function that draws PNG bytes when somebody looks, or a file inside the session's
folder; nothing else can be served.
"""

from __future__ import annotations

import threading
from collections.abc import Callable
from pathlib import Path
from typing import Final

from labeling.errors import OutsideSessionError

PNG_MAGIC: Final = b"\x89PNG\r\n\x1a\n"
PictureSource = Callable[[], bytes] | Path


class PictureShelf:
    """The pictures of a session by trial, take and name; thread-safe.

    Args:
        root: the session's folder: no file outside is served, whatever a path says.
        keep: how many takes' pictures stay on the shelf.
    """

    def __init__(self, root: Path | None, *, keep: int = 50) -> None:
        self._root = root.resolve() if root is not None else None
        self._keep = keep
        self._lock = threading.Lock()
        self._shelf: dict[tuple[str, int], dict[str, PictureSource]] = {}

    def put(self, trial_id: str, take: int, name: str, source: PictureSource) -> None:
        """Offer a picture of a take, replacing one of the same name."""
        with self._lock:
            self._shelf.setdefault((trial_id, take), {})[name] = source
            while len(self._shelf) > self._keep:
                del self._shelf[next(iter(self._shelf))]

    def names(self, trial_id: str, take: int) -> tuple[str, ...]:
        """Names of the pictures there are of a take."""
        with self._lock:
            return tuple(self._shelf.get((trial_id, take), ()))

    def draw(self, trial_id: str, take: int, name: str) -> bytes | None:
        """PNG bytes of a picture, None if there is none.

        Raises:
            OutsideSessionError: if its file is not a PNG inside the session's folder.
        """
        with self._lock:
            source = self._shelf.get((trial_id, take), {}).get(name)
        if source is None:
            return None
        content = self._read(source) if isinstance(source, Path) else source()
        if not content.startswith(PNG_MAGIC):
            raise OutsideSessionError(f"picture {name!r} is not a PNG image")
        return content

    def _read(self, path: Path) -> bytes:
        resolved = path.resolve()
        if self._root is None or not resolved.is_relative_to(self._root):
            raise OutsideSessionError(f"{path} lies outside the session's folder")
        return resolved.read_bytes()
