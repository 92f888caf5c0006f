"""Files and folders that a command writes: looked at before its work, written whole after it.

One rule for all: missing folders above a target are made; what could not be written is told before
the minutes of work that lead to it.
"""

from __future__ import annotations

import os
from collections.abc import Iterable
from pathlib import Path
from tempfile import TemporaryDirectory

from reach.errors import InvalidInputError


def check_files(paths: Iterable[Path | None]) -> None:
    """Refuse files that could not be written.

    Args:
        paths: files; None for one that was not asked for.

    Raises:
        InvalidInputError: if one is a folder, or its folder can neither be written to nor made.
    """
    for path in (path for path in paths if path is not None):
        if path.is_dir():
            raise InvalidInputError(f"cannot write {path}: it is a folder")
        _check_above(path)


def check_new_folder(path: Path) -> None:
    """Refuse a folder that could not be made, or that holds anything.

    Raises:
        InvalidInputError: naming the folder.
    """
    if path.exists() and not path.is_dir():
        raise InvalidInputError(f"cannot write {path}: it is a file; choose a new folder")
    try:
        if path.exists() and any(path.iterdir()):
            raise InvalidInputError(f"{path} exists and is not empty; choose another folder")
    except OSError as error:
        raise InvalidInputError(f"cannot write {path}: {error}") from error
    _check_above(path)


def write_text(path: Path, text: str) -> None:
    """Write a file whole: a reader sees the old one or the new one.

    Raises:
        InvalidInputError: if it cannot be written.
    """
    temporary = path.with_name(f".{path.name}.writing-{os.getpid()}")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        temporary.write_text(text, encoding="utf-8")
        os.replace(temporary, path)
    except OSError as error:
        temporary.unlink(missing_ok=True)
        raise InvalidInputError(f"cannot write {path}: {error}") from error


def _check_above(path: Path) -> None:
    try:
        above = next(one for one in path.absolute().parents if one.exists())
        with TemporaryDirectory(prefix=".writing-", dir=above):
            pass
    except OSError as error:
        raise InvalidInputError(f"cannot write {path}: {error}") from error
