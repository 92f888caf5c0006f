"""Where a take's view is drawn: a Rerun recording with the trial's clock."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np
import rerun as rr

from logs.stamps import NS
from reach.arrays import FloatArray, IntArray

ELAPSED = "elapsed"
"""Timeline: seconds since the trial's start."""
CAPTURE_TIME = "capture_time"
"""Timeline: the clock of capture."""


class Stage:
    """A recording with the trial's timelines.

    Args:
        recording: a Rerun recording stream.
        start_ns: zero of the elapsed time [ns].
    """

    def __init__(self, recording: Any, start_ns: int) -> None:
        self.recording = recording
        self.start_ns = start_ns

    def static(self, entity: str, *shown: Any) -> None:
        """Show something at all times."""
        self.recording.log(entity, *shown, static=True)

    def at(self, entity: str, time_ns: int, *shown: Any) -> None:
        """Show something from an instant on."""
        self.recording.set_time(ELAPSED, duration=(time_ns - self.start_ns) / NS)
        self.recording.set_time(CAPTURE_TIME, timestamp=np.datetime64(time_ns, "ns"))
        self.recording.log(entity, *shown)
        self.recording.reset_time()

    def columns(self, entity: str, time_ns: IntArray, columns: Iterable[Any]) -> None:
        """Show samples over time, in one piece."""
        indexes = [
            rr.TimeColumn(ELAPSED, duration=(time_ns - self.start_ns) / NS),
            rr.TimeColumn(CAPTURE_TIME, timestamp=time_ns.astype("datetime64[ns]")),
        ]
        self.recording.send_columns(entity, indexes=indexes, columns=columns)

    def poses(self, entity: str, time_ns: IntArray, T: FloatArray) -> None:
        """Show a frame over time, T_parent_frame (N, 4, 4); before, it stands where it begins."""
        if len(time_ns) == 0:
            return
        times = np.concatenate([[min(self.start_ns, int(time_ns[0]))], time_ns])
        T = np.concatenate([T[:1], T])
        columns = rr.Transform3D.columns(translation=T[:, :3, 3], mat3x3=T[:, :3, :3])
        self.columns(entity, times, columns)


def placed(T_parent_frame: FloatArray) -> Any:
    """A frame's pose as Rerun's transform."""
    return rr.Transform3D(translation=T_parent_frame[:3, 3], mat3x3=T_parent_frame[:3, :3])
