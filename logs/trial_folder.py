"""Where a take's files are: one folder a take, holding record, annotations and view.

    SESSION/trials/0007_<trial id>/          first take of trial 7
    SESSION/trials/0007_<trial id>_take2/    second take, after a redo or a void
        trial.mcap                           the record; trial.mcap.part until it is finished
        annotation.NNN.mcap                  one label or score each
        trial.rrd, trial.blind.rrd           views; may be deleted and rebuilt

Names are for people and for sorting: programs trust the ids inside the record.
"""

from __future__ import annotations

import re
from pathlib import Path

TRIALS = "trials"
RECORD_NAME = "trial.mcap"
PART_NAME = "trial.mcap.part"
VIEW_NAME = "trial.rrd"
BLIND_VIEW_NAME = "trial.blind.rrd"
_ANNOTATION = re.compile(r"annotation\.(\d{3,})\.mcap")
_FOLDER = re.compile(r"(\d{4,})_(.+?)(?:_take(\d+))?")


def take_folder(session: Path, number: int, trial_id: str, take: int = 1) -> Path:
    """Folder of a take, `trials/0007_<trial id>[_take2]`; not created here."""
    suffix = "" if take == 1 else f"_take{take}"
    return session / TRIALS / f"{number:04d}_{trial_id}{suffix}"


def take_folders(session: Path) -> list[Path]:
    """Folders of all takes of a session, in the order of trials and takes."""
    root = session / TRIALS
    if not root.is_dir():
        return []
    matched = [(path, _FOLDER.fullmatch(path.name)) for path in root.iterdir()]
    keyed = [
        ((int(match[1]), match[2], int(match[3] or 1)), path)
        for path, match in matched
        if match is not None and path.is_dir()
    ]
    return [path for _, path in sorted(keyed)]


def folder_identity(folder: Path) -> tuple[int, str, int] | None:
    """Number, trial id and take that a folder's name tells, or None for another folder."""
    match = _FOLDER.fullmatch(folder.name)
    return (int(match[1]), match[2], int(match[3] or 1)) if match else None


def annotation_paths(folder: Path) -> list[Path]:
    """A take's annotation files, oldest first."""
    if not folder.is_dir():
        return []
    matched = [(path, _ANNOTATION.fullmatch(path.name)) for path in folder.iterdir()]
    return [path for _, path in sorted((int(m[1]), path) for path, m in matched if m is not None)]


def annotation_path(folder: Path, number: int) -> Path:
    """File of a take's annotation; numbers count from 1."""
    return folder / f"annotation.{number:03d}.mcap"


def next_annotation_number(folder: Path) -> int:
    """The number after the newest annotation's, finished or not."""
    names = (path.name.removesuffix(".part") for path in folder.iterdir())
    return max((int(m[1]) for name in names if (m := _ANNOTATION.fullmatch(name))), default=0) + 1
