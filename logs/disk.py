"""How many more trials fit on the session's disk."""

from __future__ import annotations

import shutil
from pathlib import Path

RESERVE_BYTES = 512 * 2**20
FIRST_GUESS_BYTES = 4 * 2**20
"""Of a trial with its images and annotations; simulated ones take 1.6 to 3.2 MB."""


def folder_bytes(folder: Path) -> int:
    """Size of all files below a folder."""
    return sum(path.stat().st_size for path in folder.rglob("*") if path.is_file())


def bytes_per_trial(trials: Path, *, sample: int = 20) -> int:
    """Mean size of the newest recorded trials, or a first guess while there are none."""
    recorded = sorted(path for path in trials.iterdir() if path.is_dir())[-sample:]
    sizes = [size for size in map(folder_bytes, recorded) if size > 0]
    return max(sum(sizes) // len(sizes), 1) if sizes else FIRST_GUESS_BYTES


def trials_left(trials: Path, *, reserve: int = RESERVE_BYTES) -> int:
    """How many more trials fit, keeping a reserve for labels, scores and the system.

    Args:
        trials: the session's folder of recorded trials.
        reserve: bytes that stay free.
    """
    free = shutil.disk_usage(trials).free - reserve
    return max(free // bytes_per_trial(trials), 0)
