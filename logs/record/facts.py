"""What a data set takes from records, without reading their images."""

from __future__ import annotations

import hashlib
import os
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path

from logs.errors import RecordReadError, UnknownFormatError
from logs.record.descriptions import GRIPPER_DESCRIPTION, read_gripper
from logs.record.mesh_attachment import OBJECT_MESH, read_mesh
from logs.record.outline import read_attachment, read_outline
from logs.record.records import ExecutionRecord, RegistrationRecord, TrialDescriptor
from reach.arrays import FloatArray, IntArray
from reach.gripper import ParallelJawGripper


@dataclass(frozen=True, slots=True, eq=False)
class RecordFacts:
    """What a data set takes from a record.

    Args:
        path: the file.
        sha256: of it.
        descriptor: which trial, and what was tried.
        registration: the one that counts.
        execution: the one that counts.
    """

    path: Path
    sha256: str
    descriptor: TrialDescriptor
    registration: RegistrationRecord | None
    execution: ExecutionRecord | None

    @property
    def mesh(self) -> tuple[FloatArray, IntArray]:
        """Vertices and faces of the object, read from the record now."""
        return read_mesh(read_attachment(self.path, OBJECT_MESH))

    @property
    def gripper(self) -> ParallelJawGripper:
        """The hand, read from the record now."""
        return read_gripper(read_attachment(self.path, GRIPPER_DESCRIPTION))


def read_facts(paths: Sequence[Path]) -> list[RecordFacts | None]:
    """Facts of many records, in their order; None for one that is missing or damaged.

    Raises:
        UnknownFormatError: if a later release wrote one.
    """
    # Reading and hashing release the interpreter's lock: both cores work.
    with ThreadPoolExecutor(max_workers=os.cpu_count() or 1) as pool:
        return list(pool.map(_facts, paths))


def _facts(path: Path) -> RecordFacts | None:
    try:
        with path.open("rb") as stream:
            digest = hashlib.file_digest(stream, "sha256").hexdigest()
        record = read_outline(path)
    except UnknownFormatError:
        raise
    except (OSError, RecordReadError):
        return None
    return RecordFacts(path, digest, record.descriptor, record.registration, record.execution)
