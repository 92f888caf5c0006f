"""`reach evaluate`: how well each model predicted what the robot did."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

if TYPE_CHECKING:
    from logs.dataset import Dataset
    from reach.evaluation.table import Evaluation
    from reach.pose_error import PoseError

DEFAULT_MODELS = (
    "point,point-robust,ellipse,ellipse-robust,reach,reach-robust,settled,settled-robust"
)
MODELS_HELP = "Comma-separated model names; `all` takes every one, also the slow `dynamic`."


def evaluate(
    sources: Annotated[list[Path], typer.Argument(help="Data-set or session folders.")],
    models: Annotated[str, typer.Option(help=MODELS_HELP)] = DEFAULT_MODELS,
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
    draws: Annotated[int, typer.Option(help="Parameter draws of the cross-validation.")] = 100,
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
    - `reach evaluate sessions/mon sessions/tue --cross-validate --backend loky`
    """
    from collection.cli.evaluation_table import evaluation_table, print_table, progress_bars
    from collection.reporting import write_text
    from logs.dataset_sources import load_labeled
    from reach.evaluation.backends import cluster
    from reach.evaluation.compare import compare, scorers_of

    dataset = load_labeled(sources, unblinded=unblinded)
    error, basis = chosen_pose_error(dataset, pose_error)
    scorers = scorers_of(model_names(models))
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
        content = {**result.to_json(), "pose_error": basis, "simulated": dataset.simulated}
        if cross_validate:
            content["cross_validation"] = _cross_validation(
                result, error, [s.name for s in scorers], draws, seed, backend, jobs, progress
            )
    if plots is not None:
        _write_plots(result, plots)
    if as_json is not None and str(as_json) == "-":
        print(json.dumps(content))
        return
    if as_json is not None:
        write_text(as_json, json.dumps(content, indent=1) + "\n")
    print_table(evaluation_table(content))


def model_names(models: str) -> list[str]:
    """Names in a comma-separated list; `all` stands for every model."""
    from reach.models.registry import MODEL_NAMES

    if models == "all":
        return list(MODEL_NAMES)
    return list(dict.fromkeys(name.strip() for name in models.split(",") if name.strip()))


def chosen_pose_error(dataset: Dataset, given: str | None) -> tuple[PoseError, dict[str, Any]]:
    """The pose error to use, and where it is from."""
    from logs.errors import DatasetError
    from reach.pose_error import PoseError

    if given is not None:
        translation, rotation = _two_numbers(given)
        basis = "given with --pose-error"
    elif dataset.pose_error is not None:
        stated = dataset.pose_error
        translation, rotation, basis = stated.translation, stated.rotation, stated.basis
    else:
        raise DatasetError(
            f"{dataset.name!r} states no pose error; give one: --pose-error METERS,RADIANS"
        )
    error = PoseError.isotropic(translation=translation, rotation=rotation)
    return error, {"translation": translation, "rotation": rotation, "basis": basis}


def _two_numbers(text: str) -> tuple[float, float]:
    from reach.errors import InvalidInputError

    try:
        translation, rotation = (float(part) for part in text.split(","))
    except ValueError:
        raise InvalidInputError(
            f"--pose-error is {text!r}, expected METERS,RADIANS such as 0.001,0.003"
        ) from None
    return translation, rotation


def _cross_validation(
    result: Evaluation,
    error: PoseError,
    names: list[str],
    draws: int,
    seed: int,
    backend: str,
    jobs: int,
    progress: Any,
) -> dict[str, Any]:
    from reach.evaluation.cross_validation import (
        cross_validate,
        draw_parameters,
        drawable,
        variants,
    )
    from reach.models.registry import make_scorer

    parameters = draw_parameters(seed, draws)
    table: dict[str, Any] = {"draws": draws, "seed": seed, "models": {}, "exempt": []}
    for name in names:
        if not drawable(make_scorer, name):
            table["exempt"].append(name)
            continue
        table["models"][name] = [
            cross_validate(
                result.cases,
                make_scorer,
                name,
                parameters,
                saturated=saturated,
                pose_error=error,
                seed=seed,
                backend=backend,
                jobs=jobs,
                progress=progress,
            ).to_json()
            for saturated in variants(make_scorer, name)
        ]
    return table


def _write_plots(result: Evaluation, folder: Path) -> None:
    from collection.reporting import write_text
    from logs.report.curves import precision_recall_svg, reliability_svg

    folder.mkdir(parents=True, exist_ok=True)
    write_text(folder / "precision_recall.svg", precision_recall_svg(result))
    write_text(folder / "reliability.svg", reliability_svg(result))
