"""Views under construction: what they are called, and who clears away after a killed writer.

A view is drawn under a name with its writer's process id and renamed when it is whole; a killed
writer leaves that file behind. Any process may draw a view at any time, without the session's lock.
"""

from __future__ import annotations

import os
import re
from collections.abc import Iterator
from pathlib import Path

from logs.trial_folder import take_folders

_UNFINISHED = re.compile(r"\..+\.rrd\.(\d+)\.(?:part|rbl)")


def unfinished_view(out: Path) -> Path:
    """Where this process draws the view that becomes `out`."""
    return out.with_name(f".{out.name}.{os.getpid()}.part")


def unfinished_layout(out: Path) -> Path:
    """Where this process keeps the layout of the view that becomes `out`."""
    return unfinished_view(out).with_suffix(".rbl")


def remove_abandoned_views(session: Path) -> None:
    """Delete the unfinished views of processes that are no more.

    Args:
        session: the session's folder.
    """
    for folder in (session, *take_folders(session)):
        for path, process in _unfinished(folder):
            if not _is_alive(process):
                path.unlink(missing_ok=True)


def _unfinished(folder: Path) -> Iterator[tuple[Path, int]]:
    for name in os.listdir(folder):
        match = _UNFINISHED.fullmatch(name)
        if match is not None:
            yield folder / name, int(match[1])


def _is_alive(process: int) -> bool:
    try:
        os.kill(process, 0)
    except ProcessLookupError:
        return False
    except (PermissionError, OverflowError):  # somebody else's; no number of a process
        return True
    return True
