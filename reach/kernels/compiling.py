"""How kernels are compiled: cached on disk, without stale entries, and announced when it takes time.

Numba's own cache looks at the file of a function, not at the files of the functions it calls. So
the cache folder here carries a digest of every kernel's source: a changed callee can never leave
an outdated caller behind.

What makes a kernel slow to compile, measured: levels of calls (`compiled_in_place` removes one);
an array assigned to a part of another one, `a[i] = b`, for which numba compiles its whole handling
of strings to word an error (loops over numbers cost nothing); and literal arguments (`plain`).
"""

from __future__ import annotations

import logging
import os
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar, cast

import numba
import numpy as np
from numba import config

from reach.sources import source_digest

LOGGER = logging.getLogger(__name__)
NOTICE = "compiling the numerical kernels, once per installation: about a minute"
SILENCE = 600.0
"""Processes that compile within this time of the first one say nothing of it [s]."""

Function = TypeVar("Function", bound=Callable[..., Any])


def _cache_folder() -> str:
    """Folder of compiled code: $NUMBA_CACHE_DIR, beside the sources, or the user's cache."""
    here = Path(__file__).parent
    if config.CACHE_DIR:
        base = Path(config.CACHE_DIR)
    elif os.access(here, os.W_OK):
        base = here / "__pycache__"
    else:
        base = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "reach-trials"
    return str(base / f"kernels-{numba.__version__}-{source_digest(here)}")


_FOLDER = _cache_folder()


def _compile(function: Function, **options: Any) -> Function:
    before = config.CACHE_DIR
    config.CACHE_DIR = _FOLDER
    try:
        decorate = numba.njit(
            cache=True, nogil=True, error_model="numpy", no_cfunc_wrapper=True, **options
        )
        result: Function = decorate(function)
    finally:
        config.CACHE_DIR = before
    return result


def compiled(function: Function) -> Function:
    """Compile a function with numba: no Python objects, no interpreter lock, cached on disk."""
    return _compile(function)


def plain(value: int) -> int:
    """Make an integer for an argument of kernels; they are compiled anew for a literal one."""
    return cast(int, np.int64(value))


def compiled_in_place(function: Function) -> Function:
    """Compile a function as a part of each kernel that calls it.

    For long functions that are called from one place: numba optimizes all that a function calls
    once more with the function, so that every level of calls costs as much as the levels below it.
    """
    return _compile(function, inline="always")


def compiled_reductions(function: Function) -> Function:
    """Compile a function whose sums may be reordered, so that they use the vector units."""
    return _compile(function, fastmath={"reassoc", "contract", "nsz"})


_asked: set[str] = set()


def announce_compilation(kernel: Callable[..., Any]) -> None:
    """Tell the user, in one line of the log, if a kernel about to be called must be compiled first.

    The cache on disk decides, not the clock. Of several processes that compile at once, the first
    one says it. A warning of the `logging` module reaches standard error unless a program
    configures it otherwise, and never becomes an exception.

    Args:
        kernel: a compiled function; the cache is looked at once a process.
    """
    name = kernel.__name__
    if name in _asked:
        return
    _asked.add(name)
    if not any(Path(_FOLDER).rglob(f"*.{name}-*.nbi")) and _first_to_say():
        LOGGER.warning(NOTICE)


def _first_to_say() -> bool:
    """Whether no process has announced compilation lately; from now on, this one has."""
    marker = Path(_FOLDER) / "announced"
    try:
        marker.parent.mkdir(parents=True, exist_ok=True)
        try:
            marker.touch(exist_ok=False)
        except FileExistsError:
            if time.time() - marker.stat().st_mtime < SILENCE:
                return False
            marker.touch()  # of a process that was killed, or that compiled other kernels
    except OSError:
        pass  # say it too often rather than never
    return True
