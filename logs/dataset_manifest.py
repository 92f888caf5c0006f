"""dataset.json: what a data-set folder says about itself."""

from __future__ import annotations

from typing import Literal

import numpy as np
from pydantic import BaseModel, ConfigDict, Field

from logs.dataset import Dataset, StatedPoseError
from logs.labeled_trial import LeftOut
from reach.arrays import FloatArray
from reach.gripper import Box, Jaw, Pad, ParallelJawGripper

MANIFEST_NAME = "dataset.json"
FRAMES = (
    "T_parent_child maps child coordinates to parent. Gripper frame: z toward the finger tips, "
    "jaws close along x; its origin is the hand's flange. Pad frame: x toward the finger tip, z the "
    "closing direction, origin on the open pad's face. World: z up."
)
UNITS = "m, rad, N, kg, s; time stamps are nanoseconds since the epoch"
Matrix = tuple[tuple[float, ...], ...]


class Entry(BaseModel):
    """Base of the manifest's parts."""

    model_config = ConfigDict(extra="forbid", frozen=True)


class BoxEntry(Entry):
    """A solid of the gripper's body."""

    T_gripper_box: Matrix
    half_extents: tuple[float, float, float]


class JawEntry(Entry):
    """A jaw, fully open; it travels along its pad's z axis."""

    T_gripper_pad_open: Matrix
    pad_polygon: Matrix
    pad_thickness: float
    pad_max_deformation: float
    boxes: tuple[BoxEntry, ...]


class GripperEntry(Entry):
    """The hand; the jaws' full opening is twice the stroke."""

    name: str
    stroke: float
    max_force: float
    max_speed: float
    jaws: tuple[JawEntry, ...]
    palm: tuple[BoxEntry, ...]


class ObjectEntry(Entry):
    """An object: its mesh file, and what it weighs."""

    mesh: str
    geometry_sha256: str
    mass: float
    mass_source: str
    center_of_mass: tuple[float, float, float]
    volume: float
    trials: int
    successes: int


class PoseErrorEntry(Entry):
    """Standard deviations of the object's pose in the hand."""

    translation: float
    rotation: float
    basis: str


class LeftOutEntry(Entry):
    """A planned trial that does not count."""

    trial_id: str
    session: str
    number: int
    object: str
    grasp_id: str
    reason: str


class Manifest(Entry):
    """The content of dataset.json."""

    format: Literal["reach-trials labeled data set"] = "reach-trials labeled data set"
    version: Literal[1] = 1
    name: str
    origin: str
    license: str | None
    simulated: bool = Field(description="true: at least one trial was simulated")
    trials: int
    successes: int
    success_rule: str
    frames: str = FRAMES
    units: str = UNITS
    gripper: GripperEntry
    objects: dict[str, ObjectEntry]
    pose_error: PoseErrorEntry | None
    left_out: tuple[LeftOutEntry, ...]
    notes: tuple[str, ...]
    files: dict[str, str] = Field(description="SHA-256 of every file beside this one")


def make_manifest(dataset: Dataset, meshes: dict[str, str], files: dict[str, str]) -> Manifest:
    """Describe a data set.

    Args:
        dataset: what lies in the folder.
        meshes: path of each object's mesh.
        files: SHA-256 of each file by path.
    """
    stated = dataset.pose_error
    return Manifest(
        name=dataset.name,
        origin=dataset.origin,
        license=dataset.license,
        simulated=dataset.simulated,
        trials=len(dataset.trials),
        successes=dataset.successes,
        success_rule=dataset.success_rule,
        gripper=_gripper_entry(dataset.gripper),
        objects=_object_entries(dataset, meshes),
        pose_error=stated
        and PoseErrorEntry(
            translation=stated.translation, rotation=stated.rotation, basis=stated.basis
        ),
        left_out=tuple(
            LeftOutEntry(
                trial_id=row.trial_id,
                session=row.session,
                number=row.number,
                object=row.object_name,
                grasp_id=row.grasp_id,
                reason=row.reason,
            )
            for row in dataset.left_out
        ),
        notes=dataset.notes,
        files=files,
    )


def stated_pose_error(manifest: Manifest) -> StatedPoseError | None:
    """The manifest's pose error as a value."""
    entry = manifest.pose_error
    return entry and StatedPoseError(entry.translation, entry.rotation, entry.basis)


def left_out_rows(manifest: Manifest) -> tuple[LeftOut, ...]:
    """The manifest's left-out trials as values."""
    return tuple(
        LeftOut(row.trial_id, row.session, row.number, row.object, row.grasp_id, row.reason)
        for row in manifest.left_out
    )


def gripper_of(entry: GripperEntry) -> ParallelJawGripper:
    """The hand that an entry describes."""
    jaws = tuple(
        Jaw(
            Pad(np.array(jaw.pad_polygon), jaw.pad_thickness, jaw.pad_max_deformation),
            np.array(jaw.T_gripper_pad_open),
            tuple(_box(box) for box in jaw.boxes),
        )
        for jaw in entry.jaws
    )
    palm = tuple(_box(box) for box in entry.palm)
    return ParallelJawGripper(
        entry.name, jaws, entry.stroke, entry.max_force, entry.max_speed, palm
    )


def _object_entries(dataset: Dataset, meshes: dict[str, str]) -> dict[str, ObjectEntry]:
    trials = dataset.by_object()
    return {
        name: ObjectEntry(
            mesh=meshes[name],
            geometry_sha256=part.content_hash,
            mass=part.mass,
            mass_source=dataset.mass_sources.get(name, "not stated"),
            center_of_mass=tuple(part.com.tolist()),
            volume=part.volume,
            trials=len(trials.get(name, [])),
            successes=sum(trial.label.success for trial in trials.get(name, [])),
        )
        for name, part in sorted(dataset.objects.items())
    }


def _gripper_entry(gripper: ParallelJawGripper) -> GripperEntry:
    return GripperEntry(
        name=gripper.name,
        stroke=gripper.stroke,
        max_force=gripper.max_force,
        max_speed=gripper.max_speed,
        jaws=tuple(
            JawEntry(
                T_gripper_pad_open=_rows(jaw.T_gripper_pad_open),
                pad_polygon=_rows(jaw.pad.polygon),
                pad_thickness=jaw.pad.thickness,
                pad_max_deformation=jaw.pad.max_deformation,
                boxes=tuple(_box_entry(box) for box in jaw.boxes),
            )
            for jaw in gripper.jaws
        ),
        palm=tuple(_box_entry(box) for box in gripper.palm),
    )


def _box_entry(box: Box) -> BoxEntry:
    x, y, z = box.half_extents.tolist()
    return BoxEntry(T_gripper_box=_rows(box.T_gripper_box), half_extents=(x, y, z))


def _box(entry: BoxEntry) -> Box:
    return Box(np.array(entry.T_gripper_box), np.array(entry.half_extents))


def _rows(matrix: FloatArray) -> Matrix:
    return tuple(tuple(row) for row in matrix.tolist())
