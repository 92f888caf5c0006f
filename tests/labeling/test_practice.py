"""Practice runs like a session and leaves nothing behind."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from labeling.control.auto import AutoOperator
from labeling.control.commands import Actor
from labeling.display.view import console_view
from labeling.practice import practice_console
from logs.journal.events import Source
from logs.journal.state import SessionState

ACTOR = Actor("ann", Source.OPERATOR)


def test_practice_asks_and_answers_and_writes_no_file(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)

    def refuse(*arguments: object) -> int:
        raise AssertionError("practice opened a file for writing")

    monkeypatch.setattr(os, "fsync", refuse)
    with practice_console(ACTOR, pace=0.0) as console, AutoOperator(console.controller):

        def three_taken(state: SessionState) -> bool:
            return sum(len(trial.takes) > 1 for trial in state.trials.values()) > 0

        with console.controller.reading() as state:
            pass
        # Nobody knows the truth in practice: the simulated operator redoes, for ever.
        console.controller.wait_until(lambda: three_taken(state))
        assert console_view(console)["practice"] is True
    assert list(tmp_path.iterdir()) == []
    assert console.controller.closed
