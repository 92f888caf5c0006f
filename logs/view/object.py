"""The view's object: where it was found, how it moves with the hand, what else it could be."""

from __future__ import annotations

from typing import Any

import numpy as np

from logs.record.descriptions import GRIPPER_FRAME
from logs.record.mesh_attachment import OBJECT_MESH, read_mesh
from logs.record.streams import FrameTrack, JawTrack
from logs.record.trial_record import TrialRecord
from logs.view import colors
from logs.view.stage import Stage, flat_mesh, placed
from reach.arrays import FloatArray, IntArray
from reach.transforms import inverse

WORLD = "world"
OBJECT = f"{WORLD}/object"
TRUTH_FRAME = "object_truth"
"""Frame of a simulated object's true pose; never part of a blind view."""
OPENED_AGAIN = 2e-3
"""A held object is let go when the jaws are wider than at their tightest by this much [m]."""


def show_object(stage: Stage, record: TrialRecord, *, blind: bool) -> None:
    """Draw the object where it is believed to be, its rivals, and a simulation's truth."""
    stage.poses(OBJECT, *object_track(record))
    triangles = object_triangles(record)
    if triangles is None:
        return
    stage.static(f"{OBJECT}/mesh", flat_mesh(triangles, colors.OBJECT))
    stage.static(f"{OBJECT}/glass", flat_mesh(triangles, colors.OBJECT_GLASS))
    truth = record.frames.get(TRUTH_FRAME)
    if truth is not None and not blind:
        stage.poses(f"{WORLD}/truth", truth.time_ns, truth.transforms())
        stage.static(f"{WORLD}/truth/mesh", flat_mesh(triangles, colors.TRUTH))
    found = record.registration
    for number, rival in enumerate(found.rivals if found else ()):
        entity = f"{WORLD}/rivals/{number}"
        stage.static(entity, placed(rival.T_world_object), flat_mesh(triangles, colors.RIVAL))


def object_triangles(record: TrialRecord) -> FloatArray | None:
    """The object's triangles, object frame, shape (F, 3, 3) [m]; None if no mesh is attached."""
    attached = record.attachments.get(OBJECT_MESH)
    if attached is None:
        return None
    vertices, faces = read_mesh(attached.data)
    return vertices[faces]


def believed_pose(record: TrialRecord) -> FloatArray:
    """T_world_object as it was found, or as it was planned if it was not, shape (4, 4)."""
    found = record.registration
    return found.T_world_object if found else record.descriptor.T_world_object


def object_track(record: TrialRecord) -> tuple[IntArray, FloatArray]:
    """Where the object is believed to be: as it was found, then carried by the hand.

    Returns:
        Times (N,) [ns] and T_world_object (N, 4, 4).
    """
    times, poses = [record.descriptor.time_ns], [believed_pose(record)]
    carried = _carried(record)
    if carried is not None:
        track, during = carried
        T_gripper_object = inverse(record.executions[-1].executed.T_object_gripper)
        times.extend(track.time_ns[during].tolist())
        poses.extend(track.transforms()[during] @ T_gripper_object)
    return np.array(times, dtype=np.int64), np.stack(poses)


def _carried(record: TrialRecord) -> tuple[FrameTrack, Any] | None:
    """The hand's track and which samples of it carry the object."""
    execution, track = record.execution, record.frames.get(GRIPPER_FRAME)
    if execution is None or track is None or execution.sensor_verdict != "held":
        return None
    until = _let_go(record.jaw, execution.time_ns)
    carries = track.time_ns >= execution.time_ns
    return track, carries if until is None else carries & (track.time_ns <= until)


def _let_go(jaw: JawTrack, closing_ns: int) -> int | None:
    """When jaws that began to close then have opened again [ns]; None if they have not."""
    after = jaw.time_ns >= closing_ns
    times, widths = jaw.time_ns[after], jaw.widths[after]
    if not len(widths):
        return None
    tightest = int(np.argmin(widths))
    opened = times[tightest:][widths[tightest:] > widths[tightest] + OPENED_AGAIN]
    return int(opened[0]) if len(opened) else None
