"""To whom a prediction was shown, with repeats of one grasp, and what then counts as blind."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from labeling.control.commands import Actor
from logs.journal.events import Source
from logs.journal.state import PlannedEntry, SessionState
from logs.session.folder import SessionDescriptor, SessionFolder

BO = Actor("bo", Source.OPERATOR)
REPEATS = 3


@pytest.fixture
def folder(tmp_path: Path) -> SessionFolder:
    """A plan of one grasp, repeated, and of another grasp once."""
    grasps = ["g1"] * REPEATS + ["g2"]
    trials = tuple(
        PlannedEntry(
            number=number,
            trial_id=f"00000000-0000-4000-8000-{number:012d}",
            grasp_id=grasp,
            object_name="cube",
            repeat=number if grasp == "g1" else 0,
        )
        for number, grasp in enumerate(grasps, start=1)
    )
    described = SessionDescriptor(
        created_ns=1, seed=7, config={}, trials=trials, fingerprints={}, simulated=True
    )
    return SessionFolder.create(tmp_path / "session", described)


@pytest.fixture
def history(bench: Any, serve: Any, client_of: Any) -> Iterator[Callable[[], dict[int, Any]]]:
    client = client_of(serve(bench))

    def read() -> dict[int, Any]:
        items = client.get("/api/view").json()["history"]
        return {item["number"]: item.get("scores") for item in items}

    yield read


def test_scores_of_a_grasp_appear_once_none_of_its_trials_waits(bench: Any, history: Any) -> None:
    for number in range(1, REPEATS + 1):
        bench.labelled()
        bench.score(number, 0.9)
        if number < REPEATS:
            assert not any(history().values())
    assert history() == {number: {"reach": 0.9} for number in range(1, REPEATS + 1)}
    assert all(trial.label.blind for trial in bench.state.order[:REPEATS])


def test_a_grasp_taken_again_after_its_score_was_shown_is_not_blind(
    bench: Any, history: Any
) -> None:
    for number in range(1, REPEATS + 1):
        bench.labelled()
        bench.score(number, 0.9)
    assert all(history().values())
    bench.do("redo", 2, cause="seeing")
    assert not any(history().values())
    bench.labelled()
    assert bench.trial(2).takes[-1].take == 2
    assert not bench.trial(2).label.blind
    bench.do("relabel", 1, by=BO, outcome="success")
    assert bench.trial(1).label.blind


def test_a_grasp_taken_again_before_any_score_was_shown_is_blind(bench: Any) -> None:
    bench.labelled()
    bench.score(1, 0.9)
    bench.do("redo", 1, cause="seeing")
    bench.labelled()
    assert bench.trial(1).label.blind


def test_a_skipped_repeat_waits_no_longer(bench: Any, history: Any) -> None:
    bench.labelled()
    bench.score(1, 0.9)
    bench.do("skip", 2)
    assert not any(history().values())
    bench.do("skip", 3)
    assert history()[1] == {"reach": 0.9}
    bench.do("undo", 3)
    assert not any(history().values())
    bench.labelled()
    assert not bench.trial(3).label.blind


def test_who_resumes_a_session_sees_its_scores_and_is_blind_no_longer(
    make_bench: Any, folder: SessionFolder
) -> None:
    first = make_bench()
    for number in range(1, REPEATS + 1):
        first.labelled()
        first.score(number, 0.9)
    first.controller.close("ended")
    second = make_bench(operator="bo")
    second.do("relabel", 1, by=BO, outcome="failure", reason="missed")
    assert not second.trial(1).label.blind
    second.do("relabel", 1, by=Actor("cy", Source.OPERATOR), outcome="success")
    assert second.trial(1).label.blind


def test_the_journal_alone_tells_who_was_shown_a_score(bench: Any, folder: SessionFolder) -> None:
    for number in range(1, REPEATS + 1):
        bench.labelled()
        bench.score(number, 0.9)
    bench.do("redo", 1, cause="seeing")
    folded: SessionState = folder.read_state()
    for trial, told in zip(folded.order, bench.state.order, strict=True):
        assert folded.shown_to(trial) == bench.state.shown_to(told)
    assert folded.shown_to(folded.order[0]) == {"ann"}
    assert folded.shown_to(folded.order[-1]) == set()


def test_the_sensors_verdict_reaches_no_console(bench: Any, serve: Any, client_of: Any) -> None:
    bench.labelled()
    client = client_of(serve(bench))
    assert "sensor" not in client.get("/api/view").text
    bench.do("relabel", 1, outcome="failure", reason="missed")
    assert bench.trial(1).label.blind
