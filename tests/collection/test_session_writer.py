"""One writer a session, and what its journal says when a fault of ours ended it."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from collection.cli.main import main
from collection.station.station import Station
from logs.journal.events import SessionClosed
from logs.journal.file import read_journal
from logs.session.folder import SessionFolder

WORDS = "--objects cube_3cm --grasps 1 --repeats 1 --seed 8 --models point --operator auto"


def broken(*_: Any) -> None:
    raise ValueError("a fault of ours")


def unwanted(_: Station) -> Station:
    raise AssertionError("the station was spoken to")


@pytest.fixture
def session(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A session that our own fault ended in its first take."""
    out = tmp_path / "S"
    with monkeypatch.context() as patched:
        patched.setattr("collection.session.session.run_take", broken)
        with pytest.raises(ValueError, match="a fault of ours"):
            main(["collect", *WORDS.split(), "--out", str(out), "--no-report"])
    return out


def test_the_journal_names_the_fault_and_a_second_writer_never_meets_the_station(
    session: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = SessionFolder.open(session)
    closed = read_journal(folder.journal_path)[-1].event
    assert isinstance(closed, SessionClosed)
    assert (closed.status, closed.reason) == ("failed", "ValueError: a fault of ours")

    capsys.readouterr()
    monkeypatch.setattr(Station, "__enter__", unwanted)
    with folder.open_journal():
        assert main(["collect", "--resume", "--out", str(session), "--no-report"]) == 2
    (line,) = capsys.readouterr().err.strip().splitlines()
    assert "is being written by process" in line
