"""Read a user's mesh; mend what has one meaning, refuse the rest in one line."""

from __future__ import annotations

from pathlib import Path

from reach.objects import GraspObject


def read_part(path: Path, unit: str) -> GraspObject:
    """Read a mesh file as a part."""
    return GraspObject.load(path, unit=unit)
