"""Labeled trials from whatever the user names: data-set folders and session folders."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from logs.dataset.dataset import Dataset, merge, refuse_empty
from logs.dataset.files import read_dataset
from logs.dataset.manifest import MANIFEST_NAME
from logs.errors import DatasetError
from logs.session.folder import SESSION_NAME


def load_labeled(paths: Sequence[Path], *, unblinded: bool = False) -> Dataset:
    """Read and join data sets and sessions.

    Args:
        paths: folders, each with a `dataset.json` or a `session.json`.
        unblinded: let verdicts given after a prediction had been seen replace blind ones.

    Raises:
        DatasetError: a folder that is neither, folders that do not fit together, or no trial that
            counts in all of them.
    """
    dataset = merge([_load(path, unblinded) for path in paths])
    refuse_empty(dataset)
    return dataset


def _load(path: Path, unblinded: bool) -> Dataset:
    if (path / MANIFEST_NAME).is_file():
        return read_dataset(path)
    if (path / SESSION_NAME).is_file():
        from logs.dataset.from_session import session_dataset

        return session_dataset(path, unblinded=unblinded)
    problem = "does not exist" if not path.exists() else "is neither"
    raise DatasetError(
        f"{path} {problem}; expected a session folder ({SESSION_NAME}) or a data-set folder "
        f"({MANIFEST_NAME})"
    )
