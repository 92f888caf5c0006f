"""`reach report`: one HTML page about sessions or data sets."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated

import typer

from reach.models.names import ANALYTIC_NAMES


def report(
    sources: Annotated[list[Path], typer.Argument(help="Session or data-set folders.")],
    out: Annotated[
        Path | None, typer.Option(help="The page; report.html in a single source if not given.")
    ] = None,
    models: Annotated[str, typer.Option(help="Comma-separated model names; or `all`.")] = ",".join(
        ANALYTIC_NAMES
    ),
    pose_error: Annotated[
        str | None,
        typer.Option(help="Standard deviations METERS,RADIANS, instead of what the data states."),
    ] = None,
    seed: Annotated[int, typer.Option(help="Of perturbations and bootstrap.")] = 0,
    backend: Annotated[
        str, typer.Option(help="Where scores are computed: serial, threading, loky or dask.")
    ] = "threading",
    unblinded: Annotated[
        bool, typer.Option(help="Let labels given after seeing a prediction replace blind ones.")
    ] = False,
    as_json: Annotated[bool, typer.Option("--json", help="Print one JSON object.")] = False,
) -> None:
    """Write a page: success per object, models compared, reliability maps, worst mistakes, drift.

    The page holds all its pictures and opens without a network.

    - `reach report sessions/monday`
    - `reach report data/mon data/tue --out week.html --models point-robust,reach-robust`
    """
    from collection.analysis.evaluating import model_names
    from collection.analysis.reporting import write_report
    from collection.cli.evaluation_table import progress_bars
    from collection.targets import check_files

    page = out or (sources[0] / "report.html" if len(sources) == 1 else Path("report.html"))
    check_files([page])
    with progress_bars() as progress:
        result = write_report(
            sources,
            page,
            models=model_names(models),
            pose_error=pose_error,
            seed=seed,
            backend=backend,
            unblinded=unblinded,
            progress=progress,
        )
    if as_json:
        print(json.dumps({"report": str(page), **result.to_json()}))
    else:
        print(page)
