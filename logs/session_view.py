"""All trials of a session in one Rerun recording: one step a trial, disagreements first.

The recording has four timelines that order the same trials differently (by disagreement, by
number, by object, by outcome). Every step sets everything it shows, so that each order shows the
right state.
"""

from __future__ import annotations

import io
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import rerun as rr

from logs import view_colors as colors
from logs.annotation_files import read_annotations
from logs.annotations import ScoreRecord
from logs.errors import ViewError
from logs.index import list_takes
from logs.session import SessionFolder
from logs.session_blueprint import (
    CONTACTS,
    HAND,
    LIST,
    OBJECTS,
    PICTURE,
    SCENE,
    SCORES,
    SUMMARY,
    session_blueprint,
)
from logs.session_overview import OverviewRow, headline, judging_model, overview
from logs.trial_record import TrialRecord, read_record
from logs.view_contacts import (
    FORCE_SCALE,
    PROUD,
    highest_pressure,
    model_with_contacts,
    pressure_rgba,
)
from logs.view_file import view_file
from logs.view_object import believed_pose, object_triangles
from logs.view_robot import recorded_gripper, show_fingers
from logs.view_stage import flat_mesh, placed
from logs.view_text import summary
from reach.arrays import FloatArray
from reach.gripper import ParallelJawGripper

APPLICATION = "reach-trials session"
PICTURES = 300
"""Only this many trials, worst disagreements first, carry a picture: it must be decoded."""
PICTURE_WIDTH = 400


def write_session_view(session: Path, out: Path) -> Path:
    """Write the session's view.

    Args:
        session: the session's folder.
        out: the .rrd file.

    Raises:
        NotASessionError: if the folder is no session.
        ViewError: if there is nothing to show, or the file cannot be written.
    """
    folder = SessionFolder.open(session)
    shown = overview(list_takes(session))
    if not shown:
        raise ViewError(f"{session} has no executed trial to show yet")
    layout = session_blueprint(judging_model([item.row for item in shown]))
    with view_file(APPLICATION, folder.descriptor.session_id, out, layout) as recording:
        recording.send_recording_name(f"all trials of {folder.path.resolve().name}")
        _SessionDrawing(recording, folder, shown).draw()
    return out


class _SessionDrawing:
    """Draws step by step; remembers which meshes it has sent."""

    def __init__(self, recording: Any, folder: SessionFolder, shown: Sequence[OverviewRow]) -> None:
        self._recording = recording
        self._folder = folder
        self._shown = shown
        self._objects = sorted({item.row.object_name for item in shown})
        self._sent: set[str] = set()
        self._gripper: ParallelJawGripper | None = None

    def draw(self) -> None:
        self._recording.log(SCENE, rr.ViewCoordinates.RIGHT_HAND_Z_UP, static=True)
        for number, item in enumerate(self._shown):
            record = read_record(self._folder.path / item.row.folder, images=number < PICTURES)
            for timeline, place in item.places.items():
                self._recording.set_time(timeline, sequence=place)
            self._draw_trial(item, record)
        self._recording.reset_time()

    def _draw_trial(self, item: OverviewRow, record: TrialRecord) -> None:
        annotations = read_annotations(self._folder.path / item.row.folder)
        T_scene_object = _centered(record)
        self._draw_object(item.row.object_name, record, T_scene_object)
        self._draw_hand(record, T_scene_object)
        self._draw_contacts(annotations.newest_scores, T_scene_object)
        self._draw_picture(record)
        text = summary(record, annotations, blind=False)
        hint = f"`reach replay {self._folder.path} --trial {item.row.number}` shows all of it."
        self._log(SUMMARY, rr.TextDocument(f"{text}\n\n{hint}", media_type="text/markdown"))
        level = "WARN" if item.wrong else "INFO"
        self._log(LIST, rr.TextLog(headline(item), level=level))
        self._draw_scores(item)

    def _draw_object(self, name: str, record: TrialRecord, T_scene_object: FloatArray) -> None:
        if name not in self._sent:
            triangles = object_triangles(record)
            if triangles is not None:
                mesh = flat_mesh(triangles, colors.OBJECT_GLASS)
                self._recording.log(f"{OBJECTS}/{name}", mesh, static=True)
                self._sent.add(name)
        for other in self._objects:
            here = other == name
            pose = rr.InstancePoses3D(
                translations=[T_scene_object[:3, 3]],
                mat3x3=[T_scene_object[:3, :3] * (1.0 if here else 0.0)],
            )
            self._log(f"{OBJECTS}/{other}", pose)

    def _draw_hand(self, record: TrialRecord, T_scene_object: FloatArray) -> None:
        gripper = recorded_gripper(record)
        if gripper is not None and self._gripper is None:
            self._gripper = gripper
            show_fingers(self._static, HAND, gripper)
        if self._gripper is None:
            return
        execution = record.execution
        grasp = execution.executed if execution else record.descriptor.planned
        self._log(HAND, placed(T_scene_object @ grasp.T_object_gripper))
        opening = self._gripper.max_opening if grasp.opening is None else grasp.opening
        width = execution.measurements.get("width", opening) if execution else opening
        travel = 0.5 * (self._gripper.max_opening - min(width, self._gripper.max_opening))
        for number, jaw in enumerate(self._gripper.jaws):
            moved = rr.Transform3D(translation=jaw.T_gripper_pad_open[:3, 2] * travel)
            self._log(f"{HAND}/jaw_{number}", moved)

    def _draw_contacts(self, scores: Mapping[str, ScoreRecord], T_scene_object: FloatArray) -> None:
        model = model_with_contacts(dict(scores))
        if model is None:
            self._log(CONTACTS, rr.Clear(recursive=True))
            return
        score = scores[model]
        highest = highest_pressure(score)
        patches = [patch for patch in score.patches if len(patch.triangles_object)]
        self._log(CONTACTS, placed(T_scene_object))
        lifted = [p.triangles_object - PROUD * p.normal_object for p in patches]
        shades = [pressure_rgba(patch, highest) for patch in patches]
        if patches:
            mesh = flat_mesh(np.concatenate(lifted), None, np.concatenate(shades))
            self._log(f"{CONTACTS}/pressure", mesh)
        vectors = np.array([patch.force_object for patch in score.patches]) * FORCE_SCALE
        ends = np.array([patch.center_object for patch in score.patches])
        arrows = rr.Arrows3D(
            origins=ends - vectors, vectors=vectors, colors=[colors.FORCE], radii=[0.0011]
        )
        self._log(f"{CONTACTS}/force", arrows)

    def _draw_picture(self, record: TrialRecord) -> None:
        picture = _picture(record)
        if picture is None:
            self._log(PICTURE, rr.Clear(recursive=False))
        else:
            self._log(PICTURE, rr.EncodedImage(contents=picture, media_type="image/jpeg"))

    def _draw_scores(self, item: OverviewRow) -> None:
        for model, value in item.row.scores.items():
            self._log(f"{SCORES}/{model}", rr.Scalars(value))
        if item.row.outcome is not None:
            self._log(f"{SCORES}/label", rr.Scalars(float(item.row.outcome == "success")))

    def _log(self, entity: str, what: Any) -> None:
        self._recording.log(entity, what)

    def _static(self, entity: str, *what: Any) -> None:
        self._recording.log(entity, *what, static=True)


def _centered(record: TrialRecord) -> FloatArray:
    """The object as it was found, moved to the scene's middle so that all trials look alike.

    It is turned about the vertical: every hand closes along the scene's x axis, and stands
    beyond the object, seen from the eye.
    """
    T = np.array(believed_pose(record))
    execution = record.execution
    grasp = execution.executed if execution else record.descriptor.planned
    closing, approach = (T @ grasp.T_object_gripper)[:2, [0, 2]].T
    if closing[0] * approach[1] - closing[1] * approach[0] > 0:
        closing = -closing
    length = np.hypot(*closing)
    c, s = closing / length if length > 0 else (1.0, 0.0)
    turn = np.array([(c, s, 0.0), (-s, c, 0.0), (0.0, 0.0, 1.0)])
    T[:3, :3] = turn @ T[:3, :3]
    T[:2, 3] = 0.0
    return T


def _picture(record: TrialRecord) -> bytes | None:
    """A small color frame, or the depth image in gray."""
    from PIL import Image

    if record.color:
        image = Image.fromarray(record.color[0].pixels())
    elif record.depth:
        depth = record.depth[0].meters()
        near, far = np.nanpercentile(depth, [2, 98]) if np.isfinite(depth).any() else (0.0, 1.0)
        shade = np.nan_to_num((far - depth) / max(far - near, 1e-6), nan=0.0).clip(0, 1)
        image = Image.fromarray((shade * 255).astype(np.uint8), "L")
    else:
        return None
    image.thumbnail((PICTURE_WIDTH, PICTURE_WIDTH))
    buffer = io.BytesIO()
    image.save(buffer, "jpeg", quality=85)
    return buffer.getvalue()
