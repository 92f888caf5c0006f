"""`reach console`: a link that leads nowhere is told in one line, before the screen is taken."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from collection.cli.main import main
from labeling.display.console import Console
from labeling.server.access import make_access
from labeling.server.server import ConsoleServer, free_port

Refused = Callable[..., str]


@pytest.fixture
def refused(capfd: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> Refused:
    """The one line that `reach console` answers with, where there is no terminal."""
    monkeypatch.setattr("collection.session.terminal_operator.has_terminal", lambda: False)

    def run(link: str, *options: str) -> str:
        code = main(["console", link, *options])
        written, told = capfd.readouterr()
        assert (code, written) == (2, "")
        assert "\x1b" not in told
        (line,) = told.strip().splitlines()
        return line

    return run


@pytest.mark.parametrize(
    ("link", "said"),
    [
        ("http://127.0.0.1:1/#token=x", "no console answers at http://127.0.0.1:1"),
        ("http://127.0.0.1:99999/#token=x", "99999"),
        ("ftp://127.0.0.1:1/#token=x", "is no console link"),
        ("http://127.0.0.1:1/", "#token="),
    ],
)
def test_a_dead_link_is_told_at_once(refused: Refused, link: str, said: str) -> None:
    assert said in refused(link)


def test_a_stale_token_is_told(refused: Refused, bench: Any, serve: Any) -> None:
    link = serve(bench).link
    stale = link.replace("token=", "token=y")
    assert "does not know this token" in refused(stale)
    assert "needs a terminal" in refused(link)


def test_a_certificate_that_is_not_trusted_is_told(
    refused: Refused, bench: Any, make_certificate: Any, tmp_path: Path
) -> None:
    certificate, key = make_certificate(tmp_path)
    access = make_access("127.0.0.1", free_port(), token="x" * 20, certificate=certificate, key=key)
    with ConsoleServer(Console(bench.controller, bench.ann, "monday"), access) as server:
        assert "name it with --certificate" in refused(server.link)
        assert "needs a terminal" in refused(server.link, "--certificate", str(certificate))
        assert "is no TLS certificate" in refused(server.link, "--certificate", str(key))
        plain = server.link.replace("https", "http")
        assert "no console" in refused(plain)
    nothing = str(tmp_path / "nothing.pem")
    assert "nothing.pem" in refused(server.link, "--certificate", nothing)
