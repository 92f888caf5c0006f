"""How kernels are compiled: cached on disk, without stale entries, and announced when it takes time.

Numba's own cache looks at the file of a function, not at the files of the functions it calls. So
the cache folder here carries a digest of every kernel's source: a changed callee can never leave
an outdated caller behind.
"""

from __future__ import annotations

import hashlib
import logging
import os
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, TypeVar

import numba
from numba import config

LOGGER = logging.getLogger(__name__)
NOTICE_AFTER = 1.5
"""A first call longer than this is compiling, not loading from the cache [s]."""

Function = TypeVar("Function", bound=Callable[..., Any])


def _digest(folder: Path) -> str:
    digest = hashlib.sha256(numba.__version__.encode())
    for source in sorted(folder.glob("*.py")):
        digest.update(source.read_bytes())
    return digest.hexdigest()[:16]


def _cache_folder() -> str:
    """Folder of compiled code: $NUMBA_CACHE_DIR, beside the sources, or the user's cache."""
    here = Path(__file__).parent
    if config.CACHE_DIR:
        base = Path(config.CACHE_DIR)
    elif os.access(here, os.W_OK):
        base = here / "__pycache__"
    else:
        base = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "reach-trials"
    return str(base / f"kernels-{_digest(here)}")


_FOLDER = _cache_folder()


def _compile(function: Function, **options: Any) -> Function:
    before = config.CACHE_DIR
    config.CACHE_DIR = _FOLDER
    try:
        decorate = numba.njit(cache=True, nogil=True, error_model="numpy", **options)
        result: Function = decorate(function)
    finally:
        config.CACHE_DIR = before
    return result


def compiled(function: Function) -> Function:
    """Compile a function with numba: no Python objects, no interpreter lock, cached on disk."""
    return _compile(function)


def compiled_reductions(function: Function) -> Function:
    """Compile a function whose sums may be reordered, so that they use the vector units."""
    return _compile(function, fastmath={"reassoc", "contract", "nsz"})


_warm: set[str] = set()


@contextmanager
def announced_compilation(kernel: str) -> Iterator[None]:
    """Tell the user, in one line of the log, when a kernel's first call turns out to compile it.

    A warning of the `logging` module reaches standard error unless a program configures it
    otherwise, and never becomes an exception.

    Args:
        kernel: name of the kernel called inside; only its first call in a process is watched.
    """
    if kernel in _warm:
        yield
        return
    notice = threading.Timer(
        NOTICE_AFTER,
        LOGGER.warning,
        ("compiling the contact kernels, once per installation: about half a minute",),
    )
    notice.daemon = True
    notice.start()
    try:
        yield
        _warm.add(kernel)
    finally:
        notice.cancel()
