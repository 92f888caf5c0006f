"""Where a take's view is drawn: a Rerun recording with the trial's clock."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np
import rerun as rr

from logs.record.stamps import NS
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


def flat_mesh(triangles: FloatArray, color: Any, vertex_colors: Any = None) -> Any:
    """Triangles (F, 3, 3) with one normal a face, so that edges stay edges.

    A hundred thousand faces are drawn and sent as they are; vertices are not shared.
    """
    corners = triangles.reshape(-1, 3).astype(np.float32)
    cross = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    length = np.linalg.norm(cross, axis=1, keepdims=True)
    normals = np.divide(cross, length, out=np.zeros_like(cross), where=length > 0)
    return rr.Mesh3D(
        vertex_positions=corners,
        triangle_indices=np.arange(len(corners), dtype=np.uint32).reshape(-1, 3),
        vertex_normals=np.repeat(normals, 3, axis=0).astype(np.float32),
        albedo_factor=None if vertex_colors is not None else color,
        vertex_colors=vertex_colors,
    )
