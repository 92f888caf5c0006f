"""What a session is made of, before it starts or when it resumes: options, parts, plan.

Everything is checked and planned before the session's folder appears, whole, by one rename.
"""

from __future__ import annotations

import hashlib
import json
import time
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from collection.calibration.calibration import calibration_of
from collection.errors import StationFileError
from collection.plan.records import Plan
from collection.session.options import SessionOptions
from collection.session.versions import git_commit, package_versions
from logs.journal.state import PlannedEntry
from logs.record.mesh_attachment import mesh_attachment, read_mesh
from logs.session.folder import PLAN_NAME, SessionDescriptor, SessionFolder
from reach.objects import GraspObject

if TYPE_CHECKING:
    from collection.station.station import Station
    from reach.pose_error import PoseError

OBJECTS = "objects"
RAYS_PER_GRASP, LEAST_BATCH = 20, 200
"""Asking the arm what it reaches is the slow part of planning: it is asked about no more candidates
than a plan of this size needs."""


@dataclass(frozen=True, slots=True, eq=False)
class Setup:
    """A session's choices, parts and plan.

    Args:
        options: what the operator chose.
        station_text: the station file as it was read.
        objects: by name, in the plan's order.
        plan: of the session.
        simulated: whether the session that this was read from is.
    """

    options: SessionOptions
    station_text: str
    objects: Mapping[str, GraspObject]
    plan: Plan
    simulated: bool = False

    def descriptor(self, station: Station) -> SessionDescriptor:
        """What session.json will say."""
        return SessionDescriptor(
            created_ns=time.time_ns(),
            seed=self.options.seed,
            config={
                "options": self.options.model_dump(mode="json"),
                "station_file": self.station_text,
                "station": resolved_station(station),
            },
            trials=tuple(
                PlannedEntry(
                    number=trial.number,
                    trial_id=trial.trial_id,
                    grasp_id=trial.grasp_id,
                    object_name=trial.object_name,
                    repeat=trial.repeat,
                    stable_pose=self.plan.grasp(trial.grasp_id).stable_pose,
                )
                for trial in self.plan.trials
            ),
            fingerprints=fingerprints(station, self.plan),
            versions=package_versions(),
            git_commit=git_commit(),
            simulated=station.simulation is not None,
        )

    def files(self) -> dict[str, str | bytes]:
        """What lies beside session.json: the plan, and every part's mesh."""
        meshes = {
            f"{OBJECTS}/{name}.ply": mesh_attachment(part).data
            for name, part in self.objects.items()
        }
        return {PLAN_NAME: self.plan.to_json(), **meshes}


def make_setup(options: SessionOptions, station: Station) -> Setup:
    """Read the parts and plan their trials; the station's arm says what it reaches.

    Raises:
        UnknownNameError: no such part.
        InvalidMeshError: a mesh that cannot be used.
        NoGraspError: a part that the hand cannot hold.
    """
    from collection.objects import load_objects
    from collection.plan.plan import make_plan
    from collection.plan.within_reach import reach_of
    from collection.sampling import SamplingOptions

    parts = load_objects(options.objects, options.mesh_unit)
    plan = make_plan(
        parts,
        station.gripper.geometry,
        grasps=options.grasps,
        repeats=options.repeats,
        seed=options.seed,
        session=options.session,
        reachable=reach_of(station),
        min_probability=options.min_probability,
        options=SamplingOptions(batch=max(LEAST_BATCH, RAYS_PER_GRASP * options.grasps)),
    )
    return Setup(options, station.text, {part.name: part for part in parts}, plan)


def read_setup(folder: SessionFolder) -> Setup:
    """A session's own choices, parts and plan, as they were when it began."""
    config: dict[str, Any] = dict(folder.descriptor.config)
    plan = Plan.from_json(folder.plan_path.read_text())
    objects = {}
    for part in plan.objects:
        vertices, faces = read_mesh((folder.path / OBJECTS / f"{part.name}.ply").read_bytes())
        objects[part.name] = GraspObject(part.name, vertices, faces, part.mass)
    options = SessionOptions.model_validate(config["options"])
    simulated = folder.descriptor.simulated
    return Setup(options, str(config["station_file"]), objects, plan, simulated)


def resolved_station(station: Station) -> dict[str, Any]:
    """Every value of the station file, defaults included, and the camera's calibration.

    Raises:
        CalibrationError: the calibration file that the station names cannot be read.
    """
    config = station.config
    sections = {
        name: section.model_dump(mode="json")
        for name, section in ((n, getattr(config, n)) for n in type(config).model_fields)
        if hasattr(section, "model_dump")
    }
    # A calibration file's content, residuals included: its name may stay while it changes.
    calibration = calibration_of(station.camera)
    if calibration is not None:
        sections["camera"]["calibrated"] = calibration.model_dump(mode="json")
    return {"name": config.name, **sections}


def stated_pose_error(folder: SessionFolder) -> PoseError:
    """What a session's station stated of calibration and actuation, as the models are told."""
    from collection.station.station import PoseErrorConfig

    station: Any = folder.descriptor.config["station"]
    return PoseErrorConfig.model_validate(station["pose_error"]).total()


def fingerprints(station: Station, plan: Plan) -> dict[str, str]:
    """Digest of each part of the set-up whose change between two sittings matters."""
    resolved = resolved_station(station)
    camera = dict(resolved["camera"])
    calibration = {key: camera.pop(key) for key in sorted(camera) if key.startswith(("T_", "cal"))}
    return {
        "robot": _digest({k: resolved.get(k) for k in ("robot", "gripper", "motion", "workspace")}),
        "camera": _digest(camera),
        "calibration": _digest(calibration),
        "plan": plan.content_hash[:16],
    }


def same_station(station: Station, setup: Setup, path: Path) -> None:
    """Refuse another kind of station than the session's.

    Raises:
        StationFileError: a simulated session on a real station, or the other way round.
    """
    was_simulated = setup.simulated
    if was_simulated != (station.simulation is not None):
        kinds = {True: "simulated", False: "real"}
        raise StationFileError(
            f"session {path} is {kinds[was_simulated]}, station"
            f" {station.config.name!r} is {kinds[not was_simulated]}"
        )


def _digest(value: object) -> str:
    text = json.dumps(value, sort_keys=True, separators=(",", ":"))
    return hashlib.sha256(text.encode()).hexdigest()[:16]
