"""A data set from the published files of 2019, their meshes and masses."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from logs.dataset.dataset import Dataset, StatedPoseError
from logs.dataset.labeled_trial import Label, LabeledTrial
from logs.errors import DatasetError
from logs.export.names import safe_name
from logs.export.reach2019 import ROTATION_TOLERANCE, ReadRecord, read_records
from reach.errors import UnknownNameError
from reach.grasp import DEFAULT_CLOSING_FORCE
from reach.gripper import ParallelJawGripper
from reach.objects import PLA_DENSITY, GraspObject
from reach.transforms import apply

MESH_SUFFIXES = (".obj", ".stl", ".ply", ".off", ".glb")
PROJECTED_ABOVE = 1e-6

PUBLISHED_GRAMS: Mapping[str, float] = {
    "bar_clamp": 18.5,
    "book": 34.8,
    "bowl": 15.7,
    "cat": 9.9,
    "cube_3cm": 3.0,
    "endstop_holder": 16.3,
    "engine_part": 28.6,
    "fan_extruder": 7.4,
    "gearbox": 7.4,
    "large_marker": 3.2,
    "mount1": 10.4,
    "mug": 20.2,
    "nozzle": 6.3,
    "part1": 6.8,
    "part3": 13.6,
    "pawn": 18.6,
    "pear": 6.5,
    "pipe_connector": 23.5,
    "sardines": 11.2,
    "sulfur_neutron": 7.0,
    "vase": 13.1,
    "yoda": 20.4,
}
"""Masses of the printed objects of the published experiment [g]."""

STATED_POSE_ERROR = StatedPoseError(
    1e-3,
    3e-3,
    "the pose noise that the same laboratory's later work assumes, not measured here; also the "
    "models' default, judged on the published trials, which are development data",
)

PUBLISHED_RULE = (
    "Success: as the person at the robot judged after a lift of 100 mm; the exact rule is not "
    "published."
)
EXPORTED_RULE = "Success: as the session judged that was exported; this form carries no rule."


@dataclass(frozen=True, slots=True)
class MassRule:
    """How an object without a known mass gets one.

    Args:
        grams: given masses by name [g].
        density: of the material [kg/m^3].
        infill: printed share of the volume, in (0, 1].
    """

    grams: Mapping[str, float]
    density: float = PLA_DENSITY
    infill: float = 0.2

    def mass(self, name: str) -> tuple[float | None, str]:
        """Mass [kg], None for "from the volume", and where it is from."""
        if name in self.grams:
            return self.grams[name] * 1e-3, "given with --masses"
        if name in PUBLISHED_GRAMS:
            return PUBLISHED_GRAMS[name] * 1e-3, "published table, by name"
        return None, f"volume x {self.density:g} kg/m^3 x infill {self.infill:g} (assumed)"


def read_masses(path: Path) -> dict[str, float]:
    """Read {"name": grams, ...}.

    Raises:
        DatasetError: unreadable, or a mass that is not a positive number.
    """
    try:
        content = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        raise DatasetError(f"cannot read masses from {path}: {error}") from error
    if not isinstance(content, dict):
        raise DatasetError(f"{path} holds no masses; expected {{'name': grams, ...}}")
    for name, grams in content.items():
        number = isinstance(grams, int | float) and not isinstance(grams, bool)
        if not number or not np.isfinite(grams) or grams <= 0:
            raise DatasetError(f"{path}: mass of {name!r} is {grams!r}, expected grams above 0")
    return {name: float(grams) for name, grams in content.items()}


def import_reach2019(
    grasps: Path, meshes: Path, rule: MassRule, *, ignore: Sequence[Path] = (), unit: str = "m"
) -> Dataset:
    """Read published files into a data set.

    Args:
        grasps: a file, or a folder that is searched for .json files.
        meshes: folder with a mesh per object, named like it; folders in it are not searched.
        rule: masses.
        ignore: files in the folder that are not grasps, such as the masses.
        unit: of the meshes: m, cm, mm or in.

    Raises:
        DatasetError: no file, a record that does not fit, or a missing mesh.
        InvalidMeshError: a mesh that is no closed surface, or of no such size in this unit.
    """
    records = [record for path in _grasp_files(grasps, ignore) for record in read_records(path)]
    _refuse_repeats(records)
    objects, sources = _load_objects(sorted({r.record.obj for r in records}), meshes, rule, unit)
    trials, split = _trials(records, objects)
    kind = "Simulated" if any(trial.simulated for trial in trials) else "Physical"
    exported = any("simulated" in (one.record.model_extra or {}) for one in records)
    return Dataset(
        name=grasps.stem,
        origin=(
            f"{kind} trials in the form published in 2019 with the REACH model "
            f"(imported from {grasps.name})."
        ),
        objects=objects,
        mass_sources=sources,
        gripper=ParallelJawGripper.yumi(),
        trials=trials,
        pose_error=STATED_POSE_ERROR,
        notes=_notes(records, split, sorted(set(rule.grams) - set(objects))),
        success_rule=EXPORTED_RULE if exported else PUBLISHED_RULE,
    )


def _grasp_files(path: Path, ignore: Sequence[Path]) -> list[Path]:
    if path.is_file():
        return [path]
    if not path.is_dir():
        raise DatasetError(f"no file or folder at {path}")
    skipped = {one.resolve() for one in ignore}
    files = [one for one in sorted(path.rglob("*.json")) if one.resolve() not in skipped]
    if not files:
        raise DatasetError(f"folder {path} holds no .json file")
    return files


def _refuse_repeats(records: Sequence[ReadRecord]) -> None:
    seen: set[tuple[str, int, int]] = set()
    for one in records:
        key = (one.record.obj, one.record.attempt, one.record.trial)
        if key in seen:
            raise DatasetError(
                f"object {key[0]!r}, attempt {key[1]}, trial {key[2]} stands in two files"
            )
        seen.add(key)


def _load_objects(
    names: Sequence[str], meshes: Path, rule: MassRule, unit: str
) -> tuple[dict[str, GraspObject], dict[str, str]]:
    if not meshes.is_dir():
        raise DatasetError(f"no folder of meshes at {meshes}")
    found = {path.stem: path for path in sorted(meshes.iterdir(), key=_mesh_preference)}
    objects, sources = {}, {}
    for name in names:
        path = found.get(name) or found.get(safe_name(name))  # as exports name their files
        if path is None or path.suffix.lower() not in MESH_SUFFIXES:
            known = [stem for stem, p in found.items() if p.suffix.lower() in MESH_SUFFIXES]
            raise UnknownNameError(f"object (no mesh in {meshes})", name, known)
        mass, sources[name] = rule.mass(name)
        # Published trials cannot be run again with a better mesh: mend theirs, and tell.
        objects[name] = GraspObject.load(
            path,
            unit=unit,
            mass=mass,
            density=rule.density,
            infill=rule.infill,
            name=name,
            repair=True,
        )
    return objects, sources


def _mesh_preference(path: Path) -> tuple[int, str]:
    """Sort so that the preferred format of two meshes with one name comes last, and wins."""
    suffix = path.suffix.lower()
    rank = MESH_SUFFIXES.index(suffix) if suffix in MESH_SUFFIXES else len(MESH_SUFFIXES)
    return -rank, str(path)


def _trials(
    records: Sequence[ReadRecord], objects: Mapping[str, GraspObject]
) -> tuple[tuple[LabeledTrial, ...], list[str]]:
    """The trials, and the attempts whose records hold more than one planned grasp."""
    variants: dict[tuple[str, int], list[tuple[object, ...]]] = {}
    trials = []
    for number, one in enumerate(records, start=1):
        r = one.record
        known = variants.setdefault((r.obj, r.attempt), [])
        key = (r.stable_pose, r.pose, r.grasp)
        if key not in known:
            known.append(key)
        variant = known.index(key)
        grasp_id = f"{r.obj}/{r.attempt:02d}" + (f"-{variant + 1}" if variant else "")
        lowest = apply(one.T_world_object, objects[r.obj].vertices)[:, 2].min()
        trials.append(
            LabeledTrial(
                trial_id=f"{r.obj}/{r.attempt:02d}/{r.trial}",
                session="reach2019",
                number=number,
                object_name=r.obj,
                grasp_id=grasp_id,
                attempt=r.attempt,
                repeat=r.trial,
                stable_pose=r.stable_pose,
                T_world_object=one.T_world_object,
                T_object_gripper=one.T_object_gripper,
                table_height=float(lowest),
                opening=None,
                force=DEFAULT_CLOSING_FORCE,
                label=Label(r.result, source="published"),
                simulated=bool((r.model_extra or {}).get("simulated", False)),
                source_record=one.text,
            )
        )
    return tuple(trials), [f"{o}/{a:02d}" for (o, a), known in variants.items() if len(known) > 1]


def _notes(
    records: Sequence[ReadRecord], split: Sequence[str], unused: Sequence[str]
) -> tuple[str, ...]:
    notes = []
    projected = [one.deviation for one in records if one.deviation > PROJECTED_ABOVE]
    if projected:
        notes.append(
            f"{len(projected)} of {len(records)} records have rotations up to "
            f"{max(projected):.3g} off orthonormal; they were projected to the nearest rotation "
            f"(tolerance {ROTATION_TOLERANCE}), and the original numbers are kept."
        )
    if split:
        notes.append(
            "The records of these attempts hold more than one planned grasp and are counted as "
            f"several grasps: {', '.join(split)}."
        )
    extra = sorted({key for one in records for key in (one.record.model_extra or {})})
    if extra:
        notes.append(f"Keys that the published form does not have are kept: {', '.join(extra)}.")
    if unused:
        notes.append(f"--masses also names objects that no trial has: {', '.join(unused)}.")
    return tuple(notes)
