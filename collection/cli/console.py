"""`reach console`: the terminal console of a session that runs elsewhere."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer


def console(
    link: Annotated[str, typer.Argument(help="The link that the session printed.")],
    certificate: Annotated[
        Path | None, typer.Option(help="TLS certificate (PEM) of the server to trust.")
    ] = None,
) -> None:
    """Operate a session from a terminal, with the same keys as the page.

    - `reach console 'http://127.0.0.1:8000/#token=...'`
    """
    from collection.errors import OptionsError
    from collection.session.terminal_operator import has_terminal
    from labeling.terminal.link import TerminalLink, check_link, trusted

    verify = trusted(certificate)
    check_link(link, verify=verify)
    if not has_terminal():
        raise OptionsError("reach console needs a terminal, and this process has none")

    from labeling.terminal.app import TerminalConsole

    TerminalConsole(TerminalLink(link, verify=verify)).run()
