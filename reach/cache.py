"""A content-addressed cache on disk for heavy per-mesh work.

An entry's key names what was computed and from which content; entries are written whole
(temporary file, then rename), so that a killed process or two processes at once leave either
nothing or a complete entry. The folder may be deleted at any time.
"""

from __future__ import annotations

import hashlib
import os
import tempfile
import zipfile
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray


def cache_folder() -> Path:
    """Folder of the cache: $REACH_CACHE, else reach-trials in the user's cache folder."""
    chosen = os.environ.get("REACH_CACHE")
    if chosen:
        return Path(chosen)
    base = os.environ.get("XDG_CACHE_HOME")
    return (Path(base) if base else Path.home() / ".cache") / "reach-trials"


def cache_key(*parts: object) -> str:
    """Digest of what an entry depends on: content hashes, version numbers, parameters."""
    return hashlib.sha256("\x1f".join(map(repr, parts)).encode()).hexdigest()[:40]


def cached_arrays(
    kind: str, key: str, compute: Callable[[], Mapping[str, NDArray[Any]]]
) -> dict[str, NDArray[Any]]:
    """Return the arrays stored under a key, computing and storing them the first time.

    Args:
        kind: what is stored (`sdf`, `decomposition`): a sub-folder's name.
        key: from [cache_key][reach.cache.cache_key].
        compute: called when there is no readable entry; its arrays hold no objects.
    """
    path = cache_folder() / kind / f"{key}.npz"
    try:
        with np.load(path, allow_pickle=False) as entry:
            return {name: entry[name] for name in entry.files}
    except (OSError, ValueError, EOFError, KeyError, zipfile.BadZipFile):
        pass  # missing, or damaged: compute it anew
    arrays = dict(compute())
    _store(path, arrays)
    return arrays


def _store(path: Path, arrays: Mapping[str, NDArray[Any]]) -> None:
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        handle, temporary = tempfile.mkstemp(dir=path.parent, suffix=".part")
        try:
            with os.fdopen(handle, "wb") as stream:
                np.savez(stream, **arrays)  # type: ignore[arg-type]
            os.replace(temporary, path)
        except BaseException:
            Path(temporary).unlink(missing_ok=True)
            raise
    except OSError:
        return  # a full or read-only disk costs time, never a result
