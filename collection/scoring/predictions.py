"""Predictions for a recorded take, from its record alone.

What a model is told is what was known before the jaws closed: the part, the hand, the registered
pose with its uncertainty, and the planned grasp. It never sees what came of it.
"""

from __future__ import annotations

import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from logs.errors import RecordReadError
from logs.record.annotations import PatchRecord
from logs.record.descriptions import GRIPPER_DESCRIPTION, STATION_FILE, read_gripper
from logs.record.mesh_attachment import OBJECT_MESH, read_mesh
from logs.record.trial_record import TrialRecord, read_record
from reach.evaluation.scored import used_parameters
from reach.grasp import Grasp
from reach.models.names import PATCH_MODEL
from reach.models.registry import Score, make_scorer, warm_up
from reach.objects import GraspObject
from reach.pose_error import PoseError
from reach.scene import Scene

LARGEST_PATCH = 4000
"""Triangles; a larger patch is not kept with the score."""


@dataclass(frozen=True, slots=True, eq=False)
class Prediction:
    """One model's score of a take, ready to be recorded."""

    model: str
    version: str
    score: Score
    parameters: Mapping[str, float | bool | str]
    patches: tuple[PatchRecord, ...] = field(default=())


def score_take(folder: Path, models: Sequence[str], pose_error: PoseError) -> list[Prediction]:
    """Score a recorded take.

    Args:
        folder: the take's folder.
        models: names of the models.
        pose_error: of the station (calibration and actuation); the registration's own is added.

    Raises:
        RecordReadError: the record lacks the object, the hand or the registered pose.
        UnknownNameError: no model has this name.
    """
    record = read_record(folder, images=False)
    scene, grasp = scene_of(record), record.descriptor.planned
    total = pose_error + registration_error(record)
    seed = record.descriptor.seed
    return [_predict(name, scene, grasp, total, seed) for name in models]


def scene_of(record: TrialRecord) -> Scene:
    """Part, hand and registered pose of a take.

    Raises:
        RecordReadError: if one of them is missing.
    """
    for name in (OBJECT_MESH, GRIPPER_DESCRIPTION):
        if name not in record.attachments:
            raise RecordReadError(f"{record.path} holds no {name}: it cannot be scored")
    if record.registration is None:
        raise RecordReadError(f"{record.path} holds no registered pose: it cannot be scored")
    described = record.descriptor
    vertices, faces = read_mesh(record.attachments[OBJECT_MESH].data)
    part = GraspObject(
        described.object_name, vertices, faces, described.object_mass, described.center_of_mass
    )
    gripper = read_gripper(record.attachments[GRIPPER_DESCRIPTION].data)
    return Scene(part, gripper, record.registration.T_world_object, table_height(record))


def table_height(record: TrialRecord) -> float:
    """World z of the table [m], from the station file in the record; zero where it says nothing.

    Raises:
        RecordReadError: the station file in the record cannot be read.
    """
    attached = record.attachments.get(STATION_FILE)
    if attached is None:
        return 0.0
    try:
        return float(tomllib.loads(attached.data.decode())["workspace"]["table_height"])
    except KeyError:
        return 0.0
    except (ValueError, TypeError) as error:
        raise RecordReadError(f"{record.path}: {STATION_FILE} in it: {error}") from error


def registration_error(record: TrialRecord) -> PoseError:
    """A take's own registration covariance, but for turns about an axis of symmetry."""
    if record.registration is None:
        return PoseError(np.zeros((6, 6)))
    return PoseError(record.registration.covariance).without_free_turns()


def _predict(name: str, scene: Scene, grasp: Grasp, pose_error: PoseError, seed: int) -> Prediction:
    scorer = make_scorer(name)
    warm_up(scorer, scene, grasp)  # or the session's first scores carry minutes of compiling
    score = scorer.score(scene, grasp, pose_error=pose_error, seed=seed)
    patches = _patches(scene, grasp) if name == PATCH_MODEL else ()
    return Prediction(
        name, scorer.version, score, used_parameters(scorer.parameters, pose_error), patches
    )


def _patches(scene: Scene, grasp: Grasp) -> tuple[PatchRecord, ...]:
    from reach.models.area import AreaContact

    found = AreaContact().evaluate(scene, grasp).patches
    return tuple(
        PatchRecord(
            jaw=patch.jaw,
            triangles_object=patch.triangles_object,
            pressures=patch.pressures,
            area=patch.area,
            center_object=patch.center_object,
            normal_object=patch.normal_object,
            force_object=patch.force_object,
            T_object_pad=patch.T_object_pad,
        )
        for patch in found
        if len(patch.triangles_object) <= LARGEST_PATCH
    )
