"""A data set as a folder: written whole or not at all, read back exactly, and checked.

The same data set gives the same bytes. The folder appears by one rename; a killed writer leaves
at most a hidden temporary folder beside it, which the next one removes.
"""

from __future__ import annotations

import hashlib
import json
import os
import shutil
import tempfile
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from pydantic import ValidationError

from logs.dataset.dataset import Dataset, refuse_empty
from logs.dataset.labeled_trial import LabeledTrial
from logs.dataset.manifest import (
    MANIFEST_NAME,
    Manifest,
    gripper_of,
    left_out_rows,
    make_manifest,
    stated_pose_error,
)
from logs.errors import DatasetError
from reach.arrays import frozen
from reach.errors import UnknownNameError
from reach.objects import GraspObject

FORMATS = ("parquet", "csv", "graspgen", "isaac", "acronym", "reach2019")
SOURCE_RECORDS_NAME = "source_records.jsonl"


def check_formats(formats: Sequence[str]) -> None:
    """Refuse formats that there are not.

    Raises:
        UnknownNameError: no such format.
        DatasetError: none is given.
    """
    for name in formats:
        if name not in FORMATS:
            raise UnknownNameError("export format", name, FORMATS)
    if not formats:
        raise DatasetError(f"no export format given; valid: {', '.join(FORMATS)}")


def write_dataset(dataset: Dataset, folder: Path, formats: Sequence[str] = FORMATS) -> Manifest:
    """Write a data set into a new folder.

    Args:
        dataset: what to write; at least one trial.
        folder: must not exist, or be empty.
        formats: of [FORMATS][]; meshes, manifest, card and Croissant are always written.

    Raises:
        UnknownNameError: no such format.
        DatasetError: no trial to write, or the folder is not empty.
    """
    check_formats(formats)
    refuse_empty(dataset)
    if folder.exists() and (not folder.is_dir() or any(folder.iterdir())):
        raise DatasetError(f"{folder} exists and is not empty; choose another folder")
    contents, meshes = _contents(dataset, formats)
    hashes = {path: hashlib.sha256(data).hexdigest() for path, data in sorted(contents.items())}
    manifest = make_manifest(dataset, meshes, hashes)
    contents[MANIFEST_NAME] = (manifest.model_dump_json(indent=1) + "\n").encode()
    _write_whole(folder, contents)
    return manifest


def read_dataset(folder: Path) -> Dataset:
    """Read a data set that [write_dataset][] wrote.

    Raises:
        DatasetError: no data-set folder, a changed or missing file, or no trial table in it.
    """
    manifest = read_manifest(folder)
    for path, digest in manifest.files.items():
        if path.startswith(("trials.", "meshes/")) or path == SOURCE_RECORDS_NAME:
            _check_digest(folder / path, digest)
    return Dataset(
        name=manifest.name,
        origin=manifest.origin,
        objects={name: _read_object(folder, manifest, name) for name in manifest.objects},
        mass_sources={name: entry.mass_source for name, entry in manifest.objects.items()},
        gripper=gripper_of(manifest),
        trials=_read_trials(folder, manifest),
        left_out=left_out_rows(manifest),
        pose_error=stated_pose_error(manifest),
        license=manifest.license,
        notes=manifest.notes,
        success_rule=manifest.success_rule,
    )


def read_manifest(folder: Path) -> Manifest:
    """Read dataset.json.

    Raises:
        DatasetError: there is none, or it cannot be read.
    """
    path = folder / MANIFEST_NAME
    try:
        return Manifest.model_validate_json(path.read_bytes())
    except OSError as error:
        raise DatasetError(f"{folder} is no data-set folder: {error}") from error
    except ValidationError as error:
        first = error.errors()[0]
        where = ".".join(map(str, first["loc"])) or "content"
        raise DatasetError(f"{path}: {where}: {first['msg']}") from error


def _contents(dataset: Dataset, formats: Sequence[str]) -> tuple[dict[str, bytes], dict[str, str]]:
    """All files but the manifest by path, and the path of each object's mesh."""
    from logs.export.acronym import acronym_files
    from logs.export.card import CARD_NAME, card_bytes
    from logs.export.croissant import CROISSANT_NAME, croissant_bytes
    from logs.export.graspgen import graspgen_files
    from logs.export.grasps import summarize
    from logs.export.isaac_grasp import isaac_files
    from logs.export.names import file_names
    from logs.export.reach2019 import reach2019_files
    from logs.export.trial_table import CSV_NAME, PARQUET_NAME, csv_bytes, parquet_bytes
    from logs.record.mesh_attachment import mesh_attachment

    stems = file_names(dataset.objects)
    meshes = {name: f"meshes/{stem}.ply" for name, stem in stems.items()}
    files = {meshes[n]: mesh_attachment(part).data for n, part in dataset.objects.items()}
    grasp_based = {"graspgen", "isaac", "acronym"} & set(formats)
    grasps = summarize(dataset) if grasp_based else {}
    if "parquet" in formats:
        files[PARQUET_NAME] = parquet_bytes(dataset.trials)
    if "csv" in formats:
        files[CSV_NAME] = csv_bytes(dataset.trials)
    if "graspgen" in formats:
        files |= graspgen_files(dataset, grasps, meshes, stems)
    if "isaac" in formats:
        files |= isaac_files(dataset, grasps, stems)
    if "acronym" in formats:
        files |= acronym_files(dataset, grasps, meshes, stems)
    if "reach2019" in formats:
        files |= reach2019_files(dataset, stems)
    if any(trial.source_record is not None for trial in dataset.trials):
        files[SOURCE_RECORDS_NAME] = _source_records(dataset)
    hashes = {path: hashlib.sha256(data).hexdigest() for path, data in files.items()}
    files[CROISSANT_NAME] = croissant_bytes(dataset, hashes)
    files[CARD_NAME] = card_bytes(dataset, files)
    return files, meshes


def _source_records(dataset: Dataset) -> bytes:
    lines = [
        json.dumps([trial.trial_id, trial.source_record]) + "\n"
        for trial in dataset.trials
        if trial.source_record is not None
    ]
    return "".join(lines).encode()


def _write_whole(folder: Path, contents: dict[str, bytes]) -> None:
    """Write all files beside the folder, then rename."""
    folder.parent.mkdir(parents=True, exist_ok=True)
    prefix = f".{folder.name}.writing-"
    for leftover in folder.parent.glob(f"{prefix}*"):
        owner = leftover.name.removeprefix(prefix).split("-")[0]
        if owner.isdigit() and not Path(f"/proc/{owner}").exists():
            shutil.rmtree(leftover, ignore_errors=True)
    temporary = Path(tempfile.mkdtemp(prefix=f"{prefix}{os.getpid()}-", dir=folder.parent))
    try:
        for path, data in contents.items():
            target = temporary / path
            target.parent.mkdir(parents=True, exist_ok=True)
            target.write_bytes(data)
        temporary.chmod(0o755)
        os.rename(temporary, folder)  # replaces an empty folder, and nothing else
    except BaseException:
        shutil.rmtree(temporary, ignore_errors=True)
        raise


def _check_digest(path: Path, digest: str) -> None:
    try:
        found = hashlib.sha256(path.read_bytes()).hexdigest()
    except OSError as error:
        raise DatasetError(f"the data set's file is missing: {error}") from error
    if found != digest:
        raise DatasetError(
            f"{path} was changed after the data set was written (SHA-256 {found[:12]}..., "
            f"dataset.json says {digest[:12]}...)"
        )


def _read_object(folder: Path, manifest: Manifest, name: str) -> GraspObject:
    from logs.record.mesh_attachment import read_mesh

    entry = manifest.objects[name]
    vertices, faces = read_mesh((folder / entry.mesh).read_bytes())
    part = GraspObject(name, vertices, faces, entry.mass)
    if part.com.tolist() == list(entry.center_of_mass):
        return part
    return replace(part, center_of_mass=frozen(entry.center_of_mass))


def _read_trials(folder: Path, manifest: Manifest) -> tuple[LabeledTrial, ...]:
    from logs.export.trial_table import CSV_NAME, PARQUET_NAME, read_csv, read_parquet

    if PARQUET_NAME in manifest.files:
        trials = read_parquet(folder / PARQUET_NAME)
    elif CSV_NAME in manifest.files:
        trials = read_csv(folder / CSV_NAME)
    else:
        raise DatasetError(
            f"{folder} holds no trial table; export it with --format parquet or csv to read it back"
        )
    if SOURCE_RECORDS_NAME not in manifest.files:
        return trials
    lines = (folder / SOURCE_RECORDS_NAME).read_text(encoding="utf-8").splitlines()
    records = dict(json.loads(line) for line in lines)
    return tuple(replace(t, source_record=records.get(t.trial_id)) for t in trials)
