"""`reach score`: what the models say about grasps on one mesh."""

from __future__ import annotations

import json
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from reach.models.names import ANALYTIC_NAMES

if TYPE_CHECKING:
    from collections.abc import Sequence

    from collection.grasp_file import FileGrasp, GraspDocument
    from reach.arrays import FloatArray
    from reach.models.registry import Score, Scorer
    from reach.objects import GraspObject
    from reach.pose_error import PoseError


def score(
    sessions: Annotated[
        list[Path] | None, typer.Argument(help="Recorded sessions to add new scores to.")
    ] = None,
    grasps: Annotated[
        Path | None, typer.Option(help="JSON of `reach sample --json`, or a list of 4 x 4 poses.")
    ] = None,
    mesh: Annotated[
        str | None,
        typer.Option(help="A mesh file or a built-in part's name; the grasps' own if left out."),
    ] = None,
    models: Annotated[str, typer.Option(help="Names, separated by commas; or `all`.")] = ",".join(
        ANALYTIC_NAMES
    ),
    mesh_unit: Annotated[
        str | None, typer.Option(help="Unit of the mesh file: m, cm, mm or in.")
    ] = None,
    mass: Annotated[float | None, typer.Option(help="Of the part [kg].")] = None,
    force: Annotated[
        float | None, typer.Option(help="Closing force of each jaw [N]; 20 if left out.")
    ] = None,
    pose_error: Annotated[
        str | None,
        typer.Option(help="Standard deviations for robust models: meters,radians."),
    ] = None,
    seed: Annotated[
        int | None, typer.Option(min=0, help="Of the robust models' samples; 0 if left out.")
    ] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print JSON.")] = False,
) -> None:
    """Score grasps on a part with contact models, or the recorded trials of sessions anew.

    - `reach sample --mesh bracket --json > grasps.json`
    - `reach score --mesh bracket --grasps grasps.json`
    - `reach score --mesh part.stl --mesh-unit mm --grasps g.json --models reach,reach-robust --json`
    - `reach score --grasps grasps.json --models reach-robust --pose-error 0.002,0.02`
    - `reach score sessions/monday --models settled,settled-robust`
    """
    from collection.analysis.evaluating import model_names

    names = model_names(models)
    if sessions:
        _refuse_beside_sessions(
            grasps=grasps, mesh=mesh, mesh_unit=mesh_unit, mass=mass, force=force,
            pose_error=pose_error, seed=seed,
        )  # fmt: skip
        _score_sessions(sessions, names, as_json=as_json)
        return
    from collection.grasp_file import grasps_of, read_grasp_file
    from collection.objects import load_object
    from reach.models.registry import make_scorer

    scorers = [make_scorer(name) for name in names]
    error = parse_pose_error(pose_error)
    document = read_grasp_file(_given(grasps))
    part = load_object(
        _mesh_name(document, mesh, _given(grasps)),
        mesh_unit=mesh_unit or (document.mesh_unit if mesh is None else "m"),
        mass=mass,
    )
    read = grasps_of(document, 20.0 if force is None else force)
    scores = {
        scorer.name: score_all(scorer, part, read, error, seed or 0, document.gripper)
        for scorer in scorers
    }
    if as_json:
        typer.echo(json.dumps(score_document(part, scorers, scores)))
    else:
        _print_table(part, scores)


def _given(grasps: Path | None) -> Path:
    from reach.errors import InvalidInputError

    if grasps is None:
        raise InvalidInputError("give --grasps FILE, or recorded sessions to score anew")
    return grasps


def _refuse_beside_sessions(**options: object) -> None:
    """Recorded trials keep the part, the force, the pose error and the seed of their session."""
    from reach.errors import InvalidInputError

    for name, value in options.items():
        if value is not None:
            raise InvalidInputError(
                f"--{name.replace('_', '-')} {value}: recorded sessions are scored with what they"
                " recorded; leave it out, or give --grasps FILE instead of sessions"
            )


def _score_sessions(sessions: Sequence[Path], names: Sequence[str], *, as_json: bool) -> None:
    from collection.analysis.rescoring import rescore
    from collection.cli.evaluation_table import progress_bars
    from logs.session.folder import SessionFolder
    from reach.models.registry import make_scorer

    # A name that does not exist is refused before anything is written.
    for name in names:
        make_scorer(name)
    for session in sessions:
        SessionFolder.open(session)
    with progress_bars() as progress:
        results = {
            str(session): rescore(session, names, partial(progress, session.name))
            for session in sessions
        }
    for result in results.values():
        for problem in result.unreadable:
            typer.echo(f"not scored: {problem}", err=True)
    if as_json:
        counts = {name: result.scored for name, result in results.items()}
        typer.echo(json.dumps({"scored_takes": counts, "models": list(names)}))
        return
    for name, result in results.items():
        typer.echo(f"{name}: {result.scored} takes scored with {', '.join(names)}")


def parse_pose_error(text: str | None) -> PoseError | None:
    """Read `meters,radians`.

    Raises:
        InvalidInputError: not two finite numbers that are not negative.
    """
    if text is None:
        return None
    from reach.errors import InvalidInputError
    from reach.pose_error import PoseError

    try:
        translation, rotation = (float(number) for number in text.split(","))
    except ValueError:
        raise InvalidInputError(
            f"--pose-error is {text!r}, expected meters,radians such as 0.001,0.003"
        ) from None
    return PoseError.isotropic(translation=translation, rotation=rotation)


def _mesh_name(document: GraspDocument, mesh: str | None, path: Path) -> str:
    from reach.errors import InvalidInputError

    name = mesh or document.mesh or document.object
    if name is None:
        raise InvalidInputError(f"{str(path)!r} does not name its mesh; give --mesh")
    return name


def score_all(
    scorer: Scorer,
    part: GraspObject,
    grasps: Sequence[FileGrasp],
    error: PoseError | None,
    seed: int,
    gripper: str = "yumi",
) -> list[Score]:
    """Score grasps in their order; those on the same stable pose are judged in one batch."""
    from rich.progress import Progress, TimeElapsedColumn

    from reach.models.registry import warm_up
    from reach.scene import Scene

    hand = gripper_named(gripper)
    scores: list[Score | None] = [None] * len(grasps)
    columns = (*Progress.get_default_columns(), TimeElapsedColumn())
    with Progress(*columns, console=_stderr(), transient=True) as bar:
        task = bar.add_task(scorer.name, total=len(grasps))
        for indices, T_world_object in _by_pose(part, grasps):
            before = sum(result is not None for result in scores)

            def show(count: int, before: int = before) -> None:
                bar.update(task, completed=before + count)

            scene = Scene(part, hand, T_world_object)
            warm_up(scorer, scene, grasps[indices[0]].grasp)
            scored = scorer.score_many(
                scene,
                [grasps[index].grasp for index in indices],
                pose_error=error,
                seed=seed,
                progress=show,
            )
            for index, result in zip(indices, scored, strict=True):
                scores[index] = result
    return [result for result in scores if result is not None]


def gripper_named(name: str) -> Any:
    """Return a gripper by name.

    Raises:
        UnknownNameError: no gripper has this name.
    """
    from reach.errors import UnknownNameError
    from reach.gripper import ParallelJawGripper

    if name != "yumi":
        raise UnknownNameError("gripper", name, ("yumi",))
    return ParallelJawGripper.yumi()


def _by_pose(part: GraspObject, grasps: Sequence[FileGrasp]) -> list[tuple[list[int], FloatArray]]:
    """Indices of the grasps on each pose of the part; unstated poses are the most probable one."""
    from reach.stable_poses import stable_poses

    groups: dict[bytes, tuple[list[int], FloatArray]] = {}
    usual: FloatArray | None = None
    for index, entry in enumerate(grasps):
        pose = entry.T_world_object
        if pose is None:
            if usual is None:
                usual = stable_poses(part)[0].T_world_object
            pose = usual
        groups.setdefault(pose.tobytes(), ([], pose))[0].append(index)
    return list(groups.values())


def score_document(
    part: GraspObject, scorers: Sequence[Scorer], scores: dict[str, list[Score]]
) -> dict[str, Any]:
    """The JSON that `reach score --json` prints."""
    count = len(next(iter(scores.values()), []))
    return {
        "object": part.name,
        "mass": part.mass,
        "models": {
            scorer.name: {
                "version": scorer.version,
                "parameters": scorer.parameters,
                "mean": sum(s.value for s in scores[scorer.name]) / count,
                "seconds_per_grasp": sum(s.seconds for s in scores[scorer.name]) / count,
            }
            for scorer in scorers
        },
        "grasps": [
            {
                "index": index,
                "scores": {
                    name: {"value": own[index].value, **own[index].details}
                    for name, own in scores.items()
                },
            }
            for index in range(count)
        ],
    }


def _print_table(part: GraspObject, scores: dict[str, list[Score]]) -> None:
    from rich.console import Console
    from rich.table import Table

    shown = 50
    table = Table(title=f"{part.name}: predicted success")
    table.add_column("grasp", justify="right")
    for name in scores:
        table.add_column(name, justify="right")
    rows = list(zip(*scores.values(), strict=True))
    for index, row in enumerate(rows[:shown]):
        table.add_row(str(index), *(f"{result.value:.2f}" for result in row))
    means = [sum(s.value for s in own) / len(own) for own in scores.values()]
    costs = [1e3 * sum(s.seconds for s in own) / len(own) for own in scores.values()]
    table.add_section()
    table.add_row("mean", *(f"{mean:.2f}" for mean in means))
    table.add_row("ms", *(f"{cost:.3g}" for cost in costs))
    console = Console()
    console.print(table)
    if len(rows) > shown:
        console.print(f"{len(rows) - shown} more grasps: see --json")


def _stderr() -> Any:
    from rich.console import Console

    return Console(stderr=True)
