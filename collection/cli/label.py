"""`reach label`: label recorded trials again, or practice."""

from __future__ import annotations

import getpass
import json
from contextlib import AbstractContextManager
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

if TYPE_CHECKING:
    from labeling.commands import Actor
    from labeling.console import Console


def label(
    session: Annotated[
        Path | None, typer.Argument(help="The session's folder; none in practice.")
    ] = None,
    operator: Annotated[
        str | None, typer.Option(help="Your name; the login name if absent.")
    ] = None,
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
    host: Annotated[str, typer.Option(help="Address to listen on.")] = "127.0.0.1",
    port: Annotated[int, typer.Option(min=0, max=65535, help="Port; 0 takes a free one.")] = 0,
    token: Annotated[
        str | None, typer.Option(envvar="REACH_CONSOLE_TOKEN", help="Needed beyond this machine.")
    ] = None,
    certificate: Annotated[
        Path | None, typer.Option(help="TLS certificate (PEM), needed beyond this machine.")
    ] = None,
    key: Annotated[Path | None, typer.Option(help="The certificate's private key (PEM).")] = None,
) -> None:
    """Replay each trial's recording beside the keys and give it a new verdict.

    The page filters by object, outcome, registration margin, and disagreement with a model. A
    relabel never edits: the newest one counts, and those found through a model are marked.

    - `reach label sessions/monday`
    - `reach label sessions/monday --operator bo --second`
    - `reach label sessions/monday --agreement --json`
    - `reach label --practice`
    """
    from labeling.access import make_access
    from labeling.commands import Actor
    from labeling.server import ConsoleServer, free_port
    from logs.events import Source
    from reach.errors import InvalidInputError

    if practice == (session is not None):
        raise InvalidInputError("name one session's folder, or --practice without one")
    if agreement and session is not None:
        _print_agreement(session, as_json=as_json)
        return
    actor = Actor(operator or getpass.getuser(), Source.OPERATOR)
    access = make_access(
        host, port or free_port(host), token=token, certificate=certificate, key=key
    )
    with (
        _console(session, actor, second=second) as console,
        ConsoleServer(console, access) as server,
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
    from logs.recovery import recover_session
    from logs.session import SessionFolder

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
    from labeling.agreement import operator_agreement
    from logs.session import SessionFolder

    found = operator_agreement(SessionFolder.open(session).read_state())
    if as_json:
        print(json.dumps(asdict(found)))
        return
    kappa = "undefined" if found.kappa is None else f"{found.kappa:.3f}"
    print(f"{found.agreed} of {found.trials} blind verdicts agree, Cohen's kappa {kappa}")
