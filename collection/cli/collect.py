"""`reach collect`: run a session of grasp trials."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from collection.cli.console_options import LOOPBACK, Certificate, Host, Key, Name, Port, Token


def collect(
    out: Annotated[Path, typer.Option("--out", help="The session's folder.")],
    station: Annotated[
        str | None, typer.Option(help="A packaged station, or a station file. [simulated]")
    ] = None,
    objects: Annotated[
        str | None,
        typer.Option(help="Built-in names or mesh files, separated by commas; `all`."),
    ] = None,
    grasps: Annotated[int | None, typer.Option(help="Grasps an object. [25]")] = None,
    repeats: Annotated[int | None, typer.Option(help="Trials a grasp. [5]")] = None,
    operator: Annotated[
        str | None, typer.Option(help="Who labels: auto, web or terminal. [web]")
    ] = None,
    seed: Annotated[int | None, typer.Option(help="Everything random follows from it. [0]")] = None,
    session: Annotated[
        int | None,
        typer.Option(help="0, 1, ...: further trials of the same experiment, other grasps. [0]"),
    ] = None,
    mesh_unit: Annotated[
        str | None, typer.Option(help="Unit of mesh files: m, cm, mm or in. [m]")
    ] = None,
    models: Annotated[
        str | None,
        typer.Option(help="Models whose predictions annotate each trial. [all but dynamic]"),
    ] = None,
    min_probability: Annotated[
        float | None, typer.Option(help="Rarer stable poses are not planned. [0.01]")
    ] = None,
    resume: Annotated[
        bool, typer.Option("--resume", help="Continue the session in --out.")
    ] = False,
    accept_change: Annotated[
        str, typer.Option(help="With --resume: calibration, camera, robot, by commas.")
    ] = "",
    dry_run: Annotated[
        bool, typer.Option("--dry-run", help="Print the plan; nothing moves, nothing is written.")
    ] = False,
    name: Name = None,
    host: Host = LOOPBACK,
    port: Port = 0,
    token: Token = None,
    certificate: Certificate = None,
    key: Key = None,
    report: Annotated[bool, typer.Option(help="Write report.html at the end.")] = True,
    as_json: Annotated[bool, typer.Option("--json", help="Print the summary as JSON.")] = False,
) -> None:
    """Run a session of grasp trials.

    A short simulated session, labeled by a simulated operator:

        reach collect --objects cube_3cm,bracket --grasps 5 --repeats 2 --operator auto --out S

    A part of your own, and a person at the page:

        reach collect --station lab.toml --objects part.stl --mesh-unit mm --out S

    After an interruption:

        reach collect --resume --out S
    """
    from collection.conduct import conduct, show_plan
    from collection.session.opening import Conduct
    from collection.session.options import Sitting

    chosen = {
        "station": station,
        "objects": _words(objects),
        "grasps": grasps,
        "repeats": repeats,
        "operator": operator,
        "seed": seed,
        "session": session,
        "mesh_unit": mesh_unit,
        "models": _words(models),
        "min_probability": min_probability,
    }
    given = {name: value for name, value in chosen.items() if value is not None}
    sitting = Sitting(name, host, port, token, certificate, key)
    asked = Conduct(out, given, resume, _words(accept_change) or (), sitting, report, as_json)
    if dry_run:
        show_plan(asked)
    else:
        conduct(asked)


def _words(text: str | None) -> tuple[str, ...] | None:
    return None if text is None else tuple(filter(None, map(str.strip, text.split(","))))
