"""Options of every command that serves the operator's console."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

LOOPBACK = "127.0.0.1"

Name = Annotated[str | None, typer.Option(help="Who labels; the login name if left out.")]
Host = Annotated[str, typer.Option(help="Address that the console listens on.")]
Port = Annotated[int, typer.Option(min=0, max=65535, help="Its port; 0 takes a free one.")]
Token = Annotated[
    str | None, typer.Option(envvar="REACH_CONSOLE_TOKEN", help="Needed beyond this machine.")
]
Certificate = Annotated[
    Path | None, typer.Option(help="TLS certificate (PEM), needed beyond this machine.")
]
Key = Annotated[Path | None, typer.Option(help="The certificate's private key (PEM).")]
