"""A Rerun file that appears whole or not at all."""

from __future__ import annotations

import os
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from logs.errors import ViewError
from logs.unfinished_view import unfinished_layout, unfinished_view

_END = b"RRF2FOOT"
_END_SIZE = len(_END) + 4
LEAST_ROOM = 64 * 2**20
"""Bytes that must be free; a trial's view takes about two megabytes."""


@contextmanager
def view_file(
    application: str, recording_id: str, out: Path, blueprint: Any, time_ns: int | None = None
) -> Iterator[Any]:
    """A recording to draw into; at the end of the block it is the file `out`.

    Args:
        application: groups recordings that share a blueprint.
        recording_id: unique; the same for the same trial.
        out: the .rrd file; replaced if it exists.
        blueprint: stored inside.
        time_ns: the file's time of change [ns]; now if None.

    Raises:
        ViewError: if the file cannot be written.
    """
    import rerun as rr

    _free_earlier_recordings()
    temporary, layout = unfinished_view(out), unfinished_layout(out)
    recording: Any = rr.RecordingStream(application, recording_id=recording_id)
    # Rerun's own clocks say when the view was derived, which nobody asks.
    recording.set_log_time_enabled(False)
    recording.set_log_tick_enabled(False)
    try:
        _require_room(out)
        try:
            recording.set_sinks(rr.FileSink(str(temporary)))
            # As a file: given as `default_blueprint`, Rerun would keep it in memory for ever.
            blueprint.save(application, str(layout))
            recording.log_file_from_path(str(layout))
            yield recording
        finally:
            recording.disconnect()  # waits for what was still being read
        if not _is_whole(temporary):
            raise ViewError(f"cannot write the view {out}: its end is missing; is the disk full?")
        if time_ns is not None:
            os.utime(temporary, ns=(time_ns, time_ns))
        os.replace(temporary, out)
    except (OSError, RuntimeError) as error:  # Rerun reports a missing folder as RuntimeError
        raise ViewError(f"cannot write the view {out}: {error}") from error
    finally:
        temporary.unlink(missing_ok=True)
        layout.unlink(missing_ok=True)


def _free_earlier_recordings() -> None:
    """Let go of recordings nobody holds: each would keep two threads and megabytes for ever."""
    from rerun_bindings import flush_and_cleanup_orphaned_recordings

    flush_and_cleanup_orphaned_recordings()


def _require_room(out: Path) -> None:
    """Refuse a nearly full disk before Rerun writes: once its writer fails, it may wait for ever.

    Raises:
        ViewError: less than LEAST_ROOM is free.
    """
    free = shutil.disk_usage(out.parent).free
    if free < LEAST_ROOM:
        raise ViewError(f"cannot write the view {out}: {free >> 20} MB left; is the disk full?")


def _is_whole(path: Path) -> bool:
    with path.open("rb") as stream:
        size = stream.seek(0, os.SEEK_END)
        stream.seek(max(size - _END_SIZE, 0))
        return stream.read().startswith(_END)
