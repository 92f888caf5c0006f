"""Turn a name or a file into a part."""

from __future__ import annotations

import importlib
from collections.abc import Iterable
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING

from collection.errors import DuplicateNameError
from collection.objects.catalog import CATALOG, OBJECT_NAMES
from reach.errors import UnknownNameError

if TYPE_CHECKING:
    from reach.objects import GraspObject


def load_object(
    name_or_path: str | Path, mesh_unit: str = "m", mass: float | None = None
) -> GraspObject:
    """Build a built-in part or read a mesh file.

    Args:
        name_or_path: one of OBJECT_NAMES, or a mesh file.
        mesh_unit: unit of the file's numbers (m, cm, mm, in); built-in parts need none.
        mass: [kg]; if None, that of a light print (see PrintSettings).

    Raises:
        UnknownNameError: neither a built-in part nor a file, or no such unit.
        InvalidMeshError: the file's mesh cannot be used.
    """
    from reach.objects import MESH_UNITS

    if mesh_unit not in MESH_UNITS:  # also where it is not needed: it travels with the session
        raise UnknownNameError("mesh unit", mesh_unit, MESH_UNITS)
    name = str(name_or_path)
    if name in CATALOG:
        return _weighed(_built_in(name), mass)
    path = Path(name_or_path)
    if not path.is_file() and not path.suffix:
        raise UnknownNameError("object (nor is it a mesh file)", name, OBJECT_NAMES)
    from collection.objects.mesh_file import read_part

    return _weighed(read_part(path, mesh_unit), mass)


def load_objects(names: Iterable[str], mesh_unit: str = "m") -> tuple[GraspObject, ...]:
    """Build or read several parts; `all` stands for every built-in one.

    Raises:
        DuplicateNameError: two parts have one name.
    """
    wanted = [name for entry in names for name in (OBJECT_NAMES if entry == "all" else (entry,))]
    parts = tuple(load_object(name, mesh_unit) for name in wanted)
    seen: set[str] = set()
    for part in parts:
        if part.name in seen:
            raise DuplicateNameError(
                f"two objects are called {part.name!r}; list each once, or rename the mesh file"
            )
        seen.add(part.name)
    return parts


@lru_cache(maxsize=len(CATALOG))
def _built_in(name: str) -> GraspObject:
    from collection.objects.drawing import draw

    module = importlib.import_module(f"collection.objects.{CATALOG[name].module}")
    return draw(name, getattr(module, name)())


def _weighed(part: GraspObject, mass: float | None) -> GraspObject:
    from collection.objects.printing import printed_mass
    from reach.objects import GraspObject

    if mass is None:
        mass = printed_mass(part.vertices, part.faces)
    return GraspObject(part.name, part.vertices, part.faces, mass, part.center_of_mass)
