"""`reach doctor`: look at a station before anyone trusts a day to it."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer


def doctor(
    station: Annotated[
        str, typer.Option(help="A packaged station (simulated, yumi), or a station file.")
    ] = "simulated",
    out: Annotated[
        Path, typer.Option("--out", help="Where sessions will be kept; its disk is checked.")
    ] = Path("."),
    capture: Annotated[bool, typer.Option("--capture", help="Take an image, too.")] = False,
    example: Annotated[
        bool, typer.Option("--example", help="Print the packaged station's commented file.")
    ] = False,
    as_json: Annotated[bool, typer.Option("--json", help="Print the checks as JSON.")] = False,
) -> None:
    """Check robot, gripper, camera, calibration, ports and disk; nothing moves.

    Exit code 0 if nothing failed, 1 if a check failed, 2 if the station file is wrong.

        reach doctor --station simulated

        reach doctor --station lab.toml --capture --json

    To begin a station file of your own:

        reach doctor --example --station yumi > lab.toml
    """
    from collection.station.station import find_station_file

    if example:
        typer.echo(find_station_file(station).read_text(encoding="utf-8"), nl=False)
        return
    import json
    from dataclasses import asdict

    from collection.station.checkup import Status, examine
    from collection.station.station import load_station

    loaded = load_station(station)
    checks = []
    for check in examine(loaded, out, capture=capture):
        checks.append(check)
        if not as_json:
            typer.echo(f"{check.status.upper():4}  {check.name:20} {check.detail}")
    failed = any(check.status is Status.FAIL for check in checks)
    if as_json:
        report = {"station": loaded.config.name, "ok": not failed}
        typer.echo(json.dumps({**report, "checks": [asdict(check) for check in checks]}, indent=2))
    if failed:
        raise typer.Exit(1)
