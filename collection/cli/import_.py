"""`reach import`: published trials as a data set."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated, Any

import typer

IMPORT_FORMATS = ("reach2019",)


def import_(
    format_name: Annotated[str, typer.Argument(metavar="FORMAT", help="reach2019")],
    grasps: Annotated[Path, typer.Option(help="A JSON file, or a folder of them.")],
    meshes: Annotated[
        Path,
        typer.Option(
            help="Folder of meshes named like the objects; folders in it are not searched."
        ),
    ],
    out: Annotated[Path, typer.Option(help="New folder for the data set.")],
    masses: Annotated[
        Path | None,
        typer.Option(help='JSON file {"object": grams}; overrides the published table.'),
    ] = None,
    density: Annotated[
        float, typer.Option(help="Of the material, if no mass is known [kg/m3].")
    ] = (1240.0),
    infill: Annotated[float, typer.Option(help="Printed share of the volume, 0 to 1.")] = 0.2,
    mesh_unit: Annotated[str, typer.Option(help="Unit of the mesh files: m, cm, mm or in.")] = "m",
    as_json: Annotated[bool, typer.Option("--json", help="Print one JSON object.")] = False,
) -> None:
    """Read published physical trials into a data set that every other command takes.

    Rotations up to .02 off orthonormal are projected to the nearest rotation; the original
    numbers are kept, so that `reach export --format reach2019` gives them back exactly. A record
    that does not fit otherwise is refused with its number.

    - `reach import reach2019 --grasps physical/ --meshes meshes/ --out data/physical`
    - `reach import reach2019 --grasps mug.json --meshes meshes/ --masses grams.json --out data/mug`
    """
    from collection.targets import check_new_folder
    from logs.dataset.files import write_dataset
    from logs.dataset.from_reach2019 import MassRule, import_reach2019, read_masses
    from logs.numbers import counted
    from reach.arrays import positive
    from reach.errors import InvalidInputError, UnknownNameError

    if format_name not in IMPORT_FORMATS:
        raise UnknownNameError("import format", format_name, IMPORT_FORMATS)
    if not 0 < infill <= 1:
        raise InvalidInputError(f"--infill is {infill}, expected above 0 and at most 1")
    check_new_folder(out)
    grams = read_masses(masses) if masses else {}
    rule = MassRule(grams, positive(density, "--density [kg/m3]"), infill)
    ignore = [masses] if masses else []
    dataset = import_reach2019(grasps, meshes, rule, ignore=ignore, unit=mesh_unit)
    write_dataset(dataset, out, ("parquet", "csv"))
    rows: list[dict[str, Any]] = [
        {
            "object": name,
            "grams": round(dataset.objects[name].mass * 1e3, 3),
            "mass_source": dataset.mass_sources[name],
            "grasps": len({trial.grasp_id for trial in trials}),
            "trials": len(trials),
            "successes": sum(trial.label.success for trial in trials),
        }
        for name, trials in dataset.by_object().items()
    ]
    if as_json:
        facts = {"out": str(out), "trials": len(dataset.trials), "notes": list(dataset.notes)}
        print(json.dumps({**facts, "objects": rows}))
        return
    for row in rows:
        print(
            f"{row['object']}: {counted(row['grasps'], 'grasp')}, {counted(row['trials'], 'trial')}, "
            f"{row['successes']} lifted; {row['grams']:g} g ({row['mass_source']})"
        )
    for note in dataset.notes:
        print(note)
    print(f"{counted(len(dataset.trials), 'trial')} -> {out}")
