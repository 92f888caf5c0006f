"""`reach status`: where a session stands, read from its journal alone."""

from __future__ import annotations

import json
from dataclasses import asdict
from pathlib import Path
from typing import Annotated

import typer


def status(
    session: Annotated[Path, typer.Argument(help="The session's folder.")],
    as_json: Annotated[bool, typer.Option("--json", help="Print one JSON object.")] = False,
) -> None:
    """Say how far a session is; it may be running.

    - `reach status sessions/monday`
    - `reach status sessions/monday --json`
    """
    from logs.disk import trials_left
    from logs.session.folder import SessionFolder

    folder = SessionFolder.open(session)
    state = folder.read_state()
    numbers = {**asdict(state.counts()), "disk_left": trials_left(folder.trials)}
    facts = {
        "segment": state.segment,
        "simulated": folder.descriptor.simulated,
        "ended": state.closed.status if state.closed else None,
    }
    if as_json:
        print(json.dumps({**numbers, **facts}))
        return
    if facts["simulated"]:
        print("simulated station")
    for name, number in numbers.items():
        print(f"{name.replace('_', ' '):>10}  {number}")
    if state.closed is not None:
        print(f"{state.closed.status} {state.closed.reason}".strip())
