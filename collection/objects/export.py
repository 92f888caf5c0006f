"""Write parts for a printer."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from collection.objects.contact_sheet import contact_sheet
from reach.objects import MESH_UNITS, GraspObject

MASSES_FILE = "masses.json"
SHEET_FILE = "objects.png"


def export_parts(
    parts: Sequence[GraspObject], rows: Sequence[Mapping[str, Any]], folder: Path
) -> None:
    """Write each part as binary STL in millimeters, a table of masses, and a contact sheet.

    The STL keeps the part's own frame, so that poses mean the same for the file; a slicer drops
    it on its bed.

    Args:
        parts: the parts.
        rows: what to say of each in the table; `mass` in kilograms.
        folder: is made if missing; files of the same names are replaced.
    """
    import trimesh

    folder.mkdir(parents=True, exist_ok=True)
    for part in parts:
        in_millimeters = part.vertices / MESH_UNITS["mm"]
        mesh = trimesh.Trimesh(in_millimeters, part.faces, process=False)
        (folder / f"{part.name}.stl").write_bytes(mesh.export(file_type="stl"))
    masses = {"unit": "g", "masses": {row["name"]: round(row["mass"] * 1e3, 2) for row in rows}}
    (folder / MASSES_FILE).write_text(json.dumps(masses, indent=2) + "\n")
    contact_sheet(parts).quantize(64).save(folder / SHEET_FILE, optimize=True)
