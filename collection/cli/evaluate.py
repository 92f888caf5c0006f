"""`reach evaluate`: how well each model predicted what the robot did."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from reach.models.names import ANALYTIC_NAMES

if TYPE_CHECKING:
    from reach.evaluation.table import Evaluation

MODELS_HELP = "Comma-separated model names; `all` takes every one, also the slow `dynamic`."


def evaluate(
    sources: Annotated[list[Path], typer.Argument(help="Data-set or session folders.")],
    models: Annotated[str, typer.Option(help=MODELS_HELP)] = ",".join(ANALYTIC_NAMES),
    as_json: Annotated[
        Path | None, typer.Option("--json", help="Write the results here; - prints them.")
    ] = None,
    pose_error: Annotated[
        str | None,
        typer.Option(help="Standard deviations METERS,RADIANS, instead of what the data states."),
    ] = None,
    cross_validate: Annotated[
        bool, typer.Option(help="Also the paper's protocol: leave one object out.")
    ] = False,
    draws: Annotated[
        int, typer.Option(min=1, help="Parameter draws of the cross-validation.")
    ] = 100,
    markdown: Annotated[
        Path | None, typer.Option(help="Write the table as a page, beside the paper's figures.")
    ] = None,
    plots: Annotated[Path | None, typer.Option(help="Folder for the plots (SVG).")] = None,
    seed: Annotated[int, typer.Option(help="Of perturbations, draws and bootstrap.")] = 0,
    backend: Annotated[
        str, typer.Option(help="Where scores are computed: serial, threading, loky or dask.")
    ] = "threading",
    scheduler: Annotated[
        str | None, typer.Option(help="Address of a running Dask scheduler, for --backend dask.")
    ] = None,
    jobs: Annotated[int, typer.Option(help="Workers of threading and loky; -1: all cores.")] = -1,
    unblinded: Annotated[
        bool, typer.Option(help="Let labels given after seeing a prediction replace blind ones.")
    ] = False,
    fresh: Annotated[bool, typer.Option(help="Score everything anew, ignoring the cache.")] = False,
) -> None:
    """Compare models on labeled trials: AP, AR, F1, MAE, Brier score, seconds per grasp.

    One sample is one trial's label; the score is the grasp's at its planned pose; averages are
    over objects, with bootstrap intervals. Three reference rows stand beside the models: the
    constant 1, the overlap of pads and object without physics, and the oracle, which knows each
    grasp's success rate. Scores are cached; an interrupted run goes on where it stopped.

    - `reach evaluate data/physical --models point,reach,reach-robust --json table.json`
    - `reach evaluate sessions/mon sessions/tue --cross-validate --markdown table.md`
    """
    from collection.analysis.evaluating import chosen_pose_error, evaluation_content, model_names
    from collection.cli.evaluation_table import evaluation_table, print_table, progress_bars
    from collection.targets import check_files, write_text
    from logs.dataset.sources import load_labeled
    from reach.errors import InvalidInputError
    from reach.evaluation.backends import cluster
    from reach.evaluation.compare import compare, scorers_of
    from reach.evaluation.protocol import run_protocol
    from reach.models.registry import make_scorer

    if jobs != -1 and jobs < 1:
        raise InvalidInputError(f"--jobs is {jobs}, expected 1 or more, or -1 for all cores")
    printed = as_json is not None and str(as_json) == "-"
    check_files([None if printed else as_json, markdown, plots and plots / "reliability.svg"])
    scorers = scorers_of(model_names(models))
    dataset = load_labeled(sources, unblinded=unblinded)
    error, basis = chosen_pose_error(dataset, pose_error)
    cases = dataset.cases()
    with cluster(backend, scheduler), progress_bars() as progress:
        result = compare(
            cases,
            scorers,
            pose_error=error,
            seed=seed,
            backend=backend,
            jobs=jobs,
            progress=progress,
            use_cache=not fresh,
        )
        protocol = None
        if cross_validate:
            protocol = run_protocol(
                result,
                make_scorer,
                [scorer.name for scorer in scorers],
                pose_error=error,
                draws=draws,
                seed=seed,
                backend=backend,
                jobs=jobs,
                progress=progress,
            )
    content = evaluation_content(dataset, result, basis, protocol)
    if plots is not None:
        _write_plots(result, plots, simulated=dataset.simulated)
    if markdown is not None:
        from logs.report.table_page import table_page

        command = _command(
            sources,
            models=models,
            pose_error=pose_error,
            cross_validate=cross_validate,
            draws=draws if cross_validate else None,
            seed=seed,
            unblinded=unblinded,
            markdown=markdown.name,
        )
        write_text(markdown, table_page(content, command))
    if printed:
        print(json.dumps(content))
        return
    if as_json is not None:
        write_text(as_json, json.dumps(content, indent=1) + "\n")
    print_table(evaluation_table(content))


def _command(sources: list[Path], **chosen: object) -> str:
    """The command that makes a page again: what was chosen, where it is not the default."""
    options = [
        f"--{name.replace('_', '-')}" + ("" if value is True else f" {value}")
        for name, value in chosen.items()
        if value is not None and value is not False
    ]
    return " ".join(["reach evaluate", *(path.name or "." for path in sources), *options])


def _write_plots(result: Evaluation, folder: Path, *, simulated: bool) -> None:
    from collection.targets import write_text
    from logs.report.curves import SIMULATED, precision_recall_svg, reliability_svg

    mark = SIMULATED if simulated else ""
    write_text(folder / "precision_recall.svg", precision_recall_svg(result, mark=mark))
    write_text(folder / "reliability.svg", reliability_svg(result, mark=mark))
