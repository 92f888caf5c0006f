"""dataset.json: what a data-set folder says about itself."""

from __future__ import annotations

import json
from typing import Literal

from pydantic import BaseModel, ConfigDict, Field, JsonValue

from logs.dataset.dataset import Dataset, StatedPoseError
from logs.dataset.labeled_trial import LeftOut
from logs.record.descriptions import gripper_attachment, read_gripper
from reach.gripper import ParallelJawGripper

MANIFEST_NAME = "dataset.json"
FRAMES = (
    "T_parent_child maps child coordinates to parent. Gripper frame: z toward the finger tips, "
    "jaws close along x; its origin is the hand's flange. Pad frame: x toward the finger tip, z the "
    "closing direction, origin on the open pad's face. World: z up."
)
UNITS = "m, rad, N, kg, s; time stamps are nanoseconds since the epoch"


class Entry(BaseModel):
    """Base of the manifest's parts."""

    model_config = ConfigDict(extra="forbid", frozen=True)


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
    gripper: dict[str, JsonValue] = Field(
        description="the hand; the jaws' full opening is twice the stroke"
    )
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
        gripper=json.loads(gripper_attachment(dataset.gripper).data),
        objects=_object_entries(dataset, meshes),
        pose_error=None
        if stated is None
        else PoseErrorEntry(
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
    if entry is None:
        return None
    return StatedPoseError(entry.translation, entry.rotation, entry.basis)


def left_out_rows(manifest: Manifest) -> tuple[LeftOut, ...]:
    """The manifest's left-out trials as values."""
    return tuple(
        LeftOut(row.trial_id, row.session, row.number, row.object, row.grasp_id, row.reason)
        for row in manifest.left_out
    )


def gripper_of(manifest: Manifest) -> ParallelJawGripper:
    """The hand that the manifest describes.

    Raises:
        RecordReadError: if it describes none.
    """
    return read_gripper(json.dumps(manifest.gripper).encode())


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
