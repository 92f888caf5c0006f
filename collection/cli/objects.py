"""`reach objects`: the printable parts."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

if TYPE_CHECKING:
    from reach.objects import GraspObject


def objects(
    names: Annotated[
        list[str] | None, typer.Argument(help="Parts to list, built-in or mesh files; all if none.")
    ] = None,
    export: Annotated[
        Path | None, typer.Option(help="Write STL files in millimeters, masses and pictures there.")
    ] = None,
    mesh_unit: Annotated[str, typer.Option(help="Unit of mesh files: m, cm, mm or in.")] = "m",
    wall: Annotated[float, typer.Option(help="Printed wall [mm], for the mass.")] = 0.4,
    infill: Annotated[float, typer.Option(min=0, max=1, help="Printed infill, 0 to 1.")] = 0.05,
    as_json: Annotated[bool, typer.Option("--json", help="Print JSON.")] = False,
) -> None:
    """List the built-in printable parts, and write them for a printer.

    - `reach objects`
    - `reach objects bracket mug --json`
    - `reach objects --export prints --infill 0.15`
    """
    from collection.objects import load_objects
    from collection.objects.printing import PrintSettings

    settings = PrintSettings(wall=wall * 1e-3, infill=infill)
    parts = load_objects(names or ["all"], mesh_unit)
    rows = [_describe(part, settings) for part in parts]
    if export is not None:
        from collection.objects.export import export_parts

        export_parts(parts, rows, export)
    if as_json:
        typer.echo(json.dumps(rows))
    else:
        _print_table(rows)
        if export is not None:
            typer.echo(f"wrote {len(parts)} STL files, masses.json and objects.png to {export}")


def _describe(part: GraspObject, settings: Any) -> dict[str, Any]:
    """What a table says of a part; SI units."""
    import numpy as np

    from collection.objects.catalog import CATALOG
    from collection.objects.printing import printed_mass
    from reach.stable_poses import stable_poses
    from reach.symmetry import symmetry

    sym = symmetry(part)
    return {
        "name": part.name,
        "faces": len(part.faces),
        "size": np.ptp(part.vertices, axis=0).tolist(),
        "mass": printed_mass(part.vertices, part.faces, settings),
        "solid_volume": part.volume,
        "symmetry": "sphere" if sym.sphere else _symmetry_name(len(sym.rotations), sym.axis),
        "stable_poses": [pose.probability for pose in stable_poses(part)],
        "challenge": CATALOG[part.name].challenge if part.name in CATALOG else "",
    }


def _symmetry_name(order: int, axis: Any) -> str:
    if axis is not None:
        return "round" if order == 1 else "round, both ends"
    return f"{order}-fold" if order > 1 else "none"


def _print_table(rows: list[dict[str, Any]]) -> None:
    from rich.console import Console
    from rich.table import Table

    table = Table(title=f"{len(rows)} {'part' if len(rows) == 1 else 'parts'}", box=None)
    for heading in ("part", "faces", "size mm", "mass g", "symmetry", "stable poses %"):
        table.add_column(heading, no_wrap=True)
    for row in rows:
        shares = [round(100 * p) for p in row["stable_poses"]]
        table.add_row(
            row["name"],
            str(row["faces"]),
            " x ".join(f"{1e3 * edge:.0f}" for edge in row["size"]),
            f"{1e3 * row['mass']:.1f}",
            row["symmetry"],
            " ".join(map(str, shares[:4])) + (" ..." if len(shares) > 4 else ""),
        )
    console = Console()
    console.print(table)
    for row in rows:
        if row["challenge"]:
            console.print(f"{row['name']:18} {row['challenge']}", highlight=False)
