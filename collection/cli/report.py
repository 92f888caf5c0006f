"""`reach report`: one HTML page about sessions or data sets."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated

import typer

REPORT_MODELS = "point,point-robust,ellipse,ellipse-robust,reach,reach-robust"


def report(
    sources: Annotated[list[Path], typer.Argument(help="Session or data-set folders.")],
    out: Annotated[
        Path | None, typer.Option(help="The page; report.html in a single source if not given.")
    ] = None,
    models: Annotated[str, typer.Option(help="Comma-separated model names.")] = REPORT_MODELS,
    pose_error: Annotated[
        str | None,
        typer.Option(help="Standard deviations METERS,RADIANS, instead of what the data states."),
    ] = None,
    seed: Annotated[int, typer.Option(help="Of perturbations and bootstrap.")] = 0,
    backend: Annotated[
        str, typer.Option(help="Where scores are computed: serial, threading, loky or dask.")
    ] = "serial",
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
    from collection.cli.evaluate import chosen_pose_error, model_names
    from collection.cli.evaluation_table import progress_bars
    from logs.dataset_sources import load_labeled
    from logs.report.page import build_report
    from reach.evaluation.backends import cluster
    from reach.evaluation.compare import compare, scorers_of

    page = out or (sources[0] / "report.html" if len(sources) == 1 else Path("report.html"))
    dataset = load_labeled(sources, unblinded=unblinded)
    error, stated = chosen_pose_error(dataset, pose_error)
    with cluster(backend, None), progress_bars() as progress:
        result = compare(
            dataset.cases(),
            scorers_of(model_names(models)),
            pose_error=error,
            seed=seed,
            backend=backend,
            progress=progress,
        )
    write_text(page, build_report(dataset, result, error, basis=stated["basis"], seed=seed))
    if as_json:
        print(json.dumps({"report": str(page), **result.to_json()}))
    else:
        print(page)


def write_text(path: Path, text: str) -> None:
    """Write a file whole: a reader sees the old one or the new one.

    Raises:
        InvalidInputError: if it cannot be written.
    """
    import os

    from reach.errors import InvalidInputError

    temporary = path.with_name(f".{path.name}.writing-{os.getpid()}")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        temporary.write_text(text, encoding="utf-8")
        os.replace(temporary, path)
    except OSError as error:
        temporary.unlink(missing_ok=True)
        raise InvalidInputError(f"cannot write {path}: {error}") from error
