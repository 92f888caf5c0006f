"""Where object, hand and ghosts are at each step of a session's view, sent as columns.

Every object's mesh is sent once; at each step only the tried object has a size, all others have
none. So a step costs numbers, not meshes.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import rerun as rr

from logs.record.annotations import ScoreRecord
from logs.record.trial_record import TrialRecord, read_record
from logs.view import colors
from logs.view.eyes import DEFAULT_DIAMETER, tried_grasp, turned_to_hand
from logs.view.object import believed_pose, object_triangles
from logs.view.robot import recorded_gripper, show_fingers
from logs.view.session_blueprint import CONTACTS, HAND, OBJECTS, SCENE, SETTLING, time_columns
from logs.view.settling import distinct_poses, predicted_path
from logs.view.stage import flat_mesh
from reach.arrays import FloatArray
from reach.gripper import ParallelJawGripper

_NOWHERE = np.zeros((4, 4))
"""A pose without size: nothing is seen."""


@dataclass(frozen=True, slots=True, eq=False)
class _Step:
    """One trial's poses in the scene; NOWHERE if there are none.

    Args:
        name: of the object.
        object: T_scene_object, shape (4, 4).
        hand: T_scene_hand, shape (4, 4).
        width: between the pads [m].
        ghosts: T_scene_object where it settles, (4, 4), if it moves.
    """

    name: str
    object: FloatArray
    hand: FloatArray
    width: float
    ghosts: Sequence[FloatArray]


class SessionPoses:
    """Collects the poses of all steps.

    Args:
        recording: where meshes are sent at once, and poses at the end.
    """

    def __init__(self, recording: Any) -> None:
        self._recording = recording
        self._triangles: dict[str, FloatArray | None] = {}
        self._gripper: ParallelJawGripper | None = None
        self._steps: list[_Step] = []
        recording.log(SCENE, rr.ViewCoordinates.RIGHT_HAND_Z_UP, static=True)

    @property
    def diameter(self) -> float:
        """Diagonal of the newest step's object [m]."""
        triangles = self._triangles.get(self._steps[-1].name) if self._steps else None
        if triangles is None:
            return DEFAULT_DIAMETER
        return float(np.linalg.norm(np.ptp(triangles, axis=(0, 1))))

    def add_nothing(self) -> None:
        """A step whose record cannot be read."""
        self._steps.append(_Step("", _NOWHERE, _NOWHERE, 0.0, ()))

    def add(
        self, name: str, path: Path, outline: TrialRecord, scores: Mapping[str, ScoreRecord]
    ) -> None:
        """A step.

        Args:
            name: of the object.
            path: the record; its mesh and hand are read if they are new.
            outline: of the record.
            scores: newest of each model.
        """
        if name not in self._triangles or self._gripper is None:
            self._meet(name, path)
        T_scene_world = _scene_of(outline)
        T_scene_object = T_scene_world @ believed_pose(outline)
        grasp = tried_grasp(outline)
        opening = np.inf if grasp.opening is None else grasp.opening
        measured = outline.execution.measurements if outline.execution else {}
        width = measured.get("width", opening)
        hand = T_scene_object @ grasp.T_object_gripper
        ghosts = [T_scene_world @ T for T in self._ghosts(name, scores)]
        self._steps.append(_Step(name, T_scene_object, hand, width, ghosts))

    def send(self, places: Sequence[Mapping[str, int]]) -> None:
        """Send the poses of all steps.

        Args:
            places: of each step on each timeline.
        """
        times = time_columns(places)
        for name, triangles in self._triangles.items():
            if triangles is not None:
                here = [[s.object] if s.name == name else [] for s in self._steps]
                self._send_instances(f"{OBJECTS}/{name}", times, here)
                ghosts = [s.ghosts if s.name == name else [] for s in self._steps]
                self._send_instances(f"{SETTLING}/{name}", times, ghosts)
        self._send_poses(CONTACTS, times, [step.object for step in self._steps])
        if self._gripper is not None:
            self._send_poses(HAND, times, [step.hand for step in self._steps])
            for number, jaw in enumerate(self._gripper.jaws):
                opening = self._gripper.max_opening
                closed = np.array([opening - min(step.width, opening) for step in self._steps])
                moved = np.tile(np.eye(4), (len(closed), 1, 1))
                moved[:, :3, 3] = 0.5 * closed[:, None] * jaw.T_gripper_pad_open[:3, 2]
                self._send_poses(f"{HAND}/jaw_{number}", times, moved)

    def _meet(self, name: str, path: Path) -> None:
        """Send the mesh of an object, and the hand, when they are first seen."""
        record = read_record(path, images=False)
        if name not in self._triangles:
            triangles = object_triangles(record)
            self._triangles[name] = triangles
            if triangles is not None:
                mesh = flat_mesh(triangles, colors.OBJECT_GLASS)
                self._recording.log(f"{OBJECTS}/{name}", mesh, static=True)
                ghost = flat_mesh(triangles, colors.SETTLED)
                self._recording.log(f"{SETTLING}/{name}", ghost, static=True)
        if self._gripper is None:
            self._gripper = recorded_gripper(record)
            if self._gripper is not None:
                show_fingers(self._static, HAND, self._gripper)

    def _ghosts(self, name: str, scores: Mapping[str, ScoreRecord]) -> list[FloatArray]:
        """T_world_object at the end of the way that the first model that tells one predicts."""
        triangles = self._triangles[name]
        path = next((path for s in scores.values() if (path := predicted_path(s))), [])
        found = [] if triangles is None else distinct_poses(path, triangles)
        return found[-1:] if len(found) > 1 else []

    def _send_instances(
        self, entity: str, times: Sequence[Any], poses: Sequence[Sequence[FloatArray]]
    ) -> None:
        filled = [list(step) or [_NOWHERE] for step in poses]
        flat = np.stack([T for step in filled for T in step])
        columns = rr.InstancePoses3D.columns(translations=flat[:, :3, 3], mat3x3=flat[:, :3, :3])
        columns = columns.partition([len(step) for step in filled])
        self._recording.send_columns(entity, indexes=times, columns=columns)

    def _send_poses(self, entity: str, times: Sequence[Any], poses: Any) -> None:
        T = np.asarray(poses)
        columns = rr.Transform3D.columns(translation=T[:, :3, 3], mat3x3=T[:, :3, :3])
        self._recording.send_columns(entity, indexes=times, columns=columns)

    def _static(self, entity: str, *what: Any) -> None:
        self._recording.log(entity, *what, static=True)


def _scene_of(outline: TrialRecord) -> FloatArray:
    """T_scene_world: the object in the scene's middle, the hand closing along its x axis."""
    T_world_object = believed_pose(outline)
    T = np.eye(4)
    T[:3, :3] = turned_to_hand(T_world_object @ tried_grasp(outline).T_object_gripper)
    T[:2, 3] = -(T[:3, :3] @ T_world_object[:3, 3])[:2]
    return T
