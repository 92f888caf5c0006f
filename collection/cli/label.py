"""`reach label`: label recorded trials again, or practice."""

from __future__ import annotations

import json
from contextlib import AbstractContextManager
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from collection.cli.console_options import LOOPBACK, Certificate, Host, Key, Name, Port, Token

if TYPE_CHECKING:
    from labeling.control.commands import Actor
    from labeling.display.console import Console


def label(
    session: Annotated[
        Path | None, typer.Argument(help="The session's folder; none in practice.")
    ] = None,
    name: Name = None,
    second: Annotated[
        bool, typer.Option("--second", help="Label blindly as a second operator, for agreement.")
    ] = False,
    practice: Annotated[
        bool, typer.Option("--practice", help="A made-up session; nothing is stored.")
    ] = False,
    agreement: Annotated[
        bool, typer.Option("--agreement", help="Print the operators' agreement and leave.")
    ] = False,
    as_json: Annotated[bool, typer.Option("--json", help="With --agreement: as JSON.")] = False,
    host: Host = LOOPBACK,
    port: Port = 0,
    token: Token = None,
    certificate: Certificate = None,
    key: Key = None,
) -> None:
    """Replay each trial's recording beside the keys and give it a new verdict.

    The page filters by object, outcome, registration margin, and disagreement with a model. A
    relabel never edits: the newest one counts, and those found through a model are marked.

    - `reach label sessions/monday`
    - `reach label sessions/monday --name bo --second`
    - `reach label sessions/monday --agreement --json`
    - `reach label --practice`
    """
    from collection.session.options import Sitting
    from labeling.server.server import ConsoleServer
    from reach.errors import InvalidInputError

    if practice == (session is not None):
        raise InvalidInputError("name one session's folder, or --practice without one")
    if as_json and not agreement:
        raise InvalidInputError("--json goes with --agreement")
    if agreement and session is not None:
        _print_agreement(session, as_json=as_json)
        return
    sitting = Sitting(name, host, port, token, certificate, key)
    with (
        _console(session, sitting.actor(), second=second) as console,
        ConsoleServer(console, sitting.access()) as server,
    ):
        print(server.link, flush=True)
        print("Ctrl-C ends.", flush=True)
        _wait_for_interrupt()
    if second and session is not None:
        _print_agreement(session, as_json=False)


def _console(
    session: Path | None, actor: Actor, *, second: bool
) -> AbstractContextManager[Console]:
    from labeling.practice import practice_console
    from labeling.reviewing import review_console
    from logs.session.folder import SessionFolder
    from logs.session.recovery import recover_session

    if session is None:
        return practice_console(actor)
    folder = SessionFolder.open(session)
    for finding in recover_session(session).findings:
        print(f"{finding.place}: {finding.text}")
    return review_console(folder, actor, second=second)


def _wait_for_interrupt() -> None:
    import signal
    import time

    before = signal.signal(signal.SIGTERM, signal.default_int_handler)
    try:
        while True:
            time.sleep(3600)
    except KeyboardInterrupt:
        return
    finally:
        signal.signal(signal.SIGTERM, before)


def _print_agreement(session: Path, *, as_json: bool) -> None:
    from labeling.agreement import describe, operator_agreement
    from logs.session.folder import SessionFolder

    found = operator_agreement(SessionFolder.open(session).read_state())
    print(json.dumps(asdict(found)) if as_json else describe(found))
