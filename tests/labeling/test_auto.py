"""The simulated operator: the same path as a person, and marked in every event."""

from __future__ import annotations

from pathlib import Path
from types import ModuleType
from typing import Any

import pytest

from labeling.control.auto import AutoOperator
from labeling.errors import SessionEndingError
from logs.journal.events import Phase, SensorVerdict
from logs.journal.file import read_journal
from logs.session.folder import SessionFolder


def test_a_whole_session_runs_and_every_decision_is_marked_simulated(
    tmp_path: Path, fake_session: ModuleType
) -> None:
    fake_session.run(tmp_path / "s", 6)
    folder = SessionFolder.open(tmp_path / "s")
    state = folder.read_state()
    assert (state.counts().labelled, state.counts().voided) == (6, 1)
    for trial in state.order:
        truth = fake_session.truth_of(trial.planned.number)
        assert trial.label is not None
        assert (trial.label.outcome, trial.label.reason) == (truth.outcome, truth.reason)
        assert trial.label.rotated == truth.rotated
    decided = [e.event for e in read_journal(folder.journal_path) if hasattr(e.event, "command_id")]
    decided = [event for event in decided if event.command_id is not None]
    assert len(decided) >= 12
    assert {event.source for event in decided} == {"operator_sim"}


def test_it_redoes_what_nobody_saw(bench: Any) -> None:
    take = bench.executed()  # the bench records no truth
    with AutoOperator(bench.controller):
        assert take.await_label().kind == "redo"
    assert bench.trial(1).takes[0].ended_because == "seeing"


def test_it_chooses_the_pose_it_is_told_to(bench: Any) -> None:
    take = bench.begin()
    with AutoOperator(bench.controller, choose_pose=lambda trial, take: 1):
        take.wait_placed()
        take.advance(Phase.REGISTER)
        assert take.confirm_pose({"rivals": [{}]}) == 1


def test_it_waits_while_the_session_is_stopped(bench: Any) -> None:
    take = bench.begin()
    bench.do("stop")
    with AutoOperator(bench.controller):
        bench.controller.announce()
        assert not bench.trial(1).takes[0].placed
        bench.do("clear_stop", confirm=True)
        take.wait_placed()


def test_it_leaves_at_once(bench: Any) -> None:
    bench.begin().record_executed("r", SensorVerdict(lifted=None))
    with AutoOperator(bench.controller) as operator:
        pass
    assert not operator._thread.is_alive()


def test_an_operator_who_fails_ends_the_session_and_is_told(bench: Any) -> None:
    def fail(trial: object, take: object) -> int:
        raise ZeroDivisionError("no pose to compare with")

    def run() -> None:
        with AutoOperator(bench.controller, choose_pose=fail):
            take = bench.begin()
            take.wait_placed()
            take.advance(Phase.REGISTER)
            with pytest.raises(SessionEndingError):
                take.confirm_pose({"rivals": [{}]})

    with pytest.raises(ZeroDivisionError):
        run()
