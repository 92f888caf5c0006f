"""File names for objects and grasps, whatever characters their names hold."""

from __future__ import annotations

import re
from collections.abc import Iterable

_UNSAFE = re.compile(r"[^A-Za-z0-9._-]+")


def safe_name(name: str) -> str:
    """The name with everything but letters, digits, dot, dash and underscore replaced."""
    return _UNSAFE.sub("_", name).strip(".") or "unnamed"


def file_names(names: Iterable[str]) -> dict[str, str]:
    """A distinct safe file stem for each name, the same for the same set of names."""
    result: dict[str, str] = {}
    taken: set[str] = set()
    for name in sorted(names):
        stem = candidate = safe_name(name)
        number = 2
        while candidate.lower() in taken:
            candidate = f"{stem}_{number}"
            number += 1
        taken.add(candidate.lower())
        result[name] = candidate
    return result
