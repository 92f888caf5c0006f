"""`reach export`: the labeled data set, in the formats that other tools load."""

from __future__ import annotations

from collections import Counter
from dataclasses import replace
from pathlib import Path
from typing import Annotated

import typer

FORMAT_HELP = "Comma-separated: parquet, csv, graspgen, isaac, acronym, reach2019; or all."


def export(
    sources: Annotated[list[Path], typer.Argument(help="Session or data-set folders.")],
    to: Annotated[Path, typer.Option(help="New folder for the data set.")],
    formats: Annotated[str, typer.Option("--format", help=FORMAT_HELP)] = "parquet,csv",
    unblinded: Annotated[
        bool, typer.Option(help="Let labels given after seeing a prediction replace blind ones.")
    ] = False,
    license_: Annotated[
        str | None,
        typer.Option(
            "--license", help="Terms of use, such as CC-BY-4.0; the sources' own if not given."
        ),
    ] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print one JSON object.")] = False,
) -> None:
    """Write the labeled trials of one or more sessions as a data set.

    Only trials that were labeled and not voided are written; the data card says how many were
    left out and why. The same session gives the same bytes.

    - `reach export sessions/monday --to data/monday`
    - `reach export sessions/mon sessions/tue --to data/week --format all --license CC-BY-4.0`
    """
    from collection.targets import check_new_folder
    from logs.dataset.files import FORMATS, check_formats, write_dataset
    from logs.dataset.sources import load_labeled
    from logs.numbers import counted

    wanted = _split(formats)
    if "all" in wanted:
        wanted = list(FORMATS)
    check_formats(wanted)
    check_new_folder(to)
    dataset = load_labeled(sources, unblinded=unblinded)
    if license_ is not None:
        dataset = replace(dataset, license=license_)
    manifest = write_dataset(dataset, to, wanted)
    if as_json:
        print(
            manifest.model_dump_json(include={"name", "trials", "successes", "simulated", "files"})
        )
        return
    marked = " (simulated)" if manifest.simulated else ""
    trials, objects = counted(manifest.trials, "trial"), counted(len(manifest.objects), "object")
    print(f"{trials}{marked} of {objects} -> {to}")
    for reason, count in sorted(Counter(row.reason for row in dataset.left_out).items()):
        print(f"  left out: {count} {reason}")
    print(f"  {to / 'README.md'} is the data card")


def _split(text: str) -> list[str]:
    return [part.strip() for part in text.split(",") if part.strip()]
