"""Scoring beside a session: what fails there fails no session, and leaving takes no time."""

from __future__ import annotations

import multiprocessing
import os
import time
from collections.abc import Iterator
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from collection.scoring.annotator import Annotator
from logs.trial_folder import RECORD_NAME
from reach.pose_error import PoseError


@pytest.fixture
def told() -> list[str]:
    return []


@pytest.fixture
def controller() -> Any:
    return SimpleNamespace(ending=False)


@pytest.fixture
def annotator(tmp_path: Path, controller: Any, told: list[str]) -> Iterator[Annotator]:
    journal: Any = SimpleNamespace(wait_mirrored=lambda: None)
    session: Any = SimpleNamespace(path=tmp_path)
    exact = PoseError.isotropic(translation=0, rotation=0)
    with Annotator(session, controller, journal, ("point",), exact, told.append) as made:
        yield made


@pytest.fixture
def take() -> Any:
    return SimpleNamespace(take=1, record=f"trials/1/{RECORD_NAME}", scores={})


@pytest.fixture
def stuck(tmp_path: Path, take: Any) -> Any:
    """A take whose record never comes from the disk."""
    record = tmp_path / take.record
    record.parent.mkdir(parents=True)
    os.mkfifo(record)
    return take


def helper() -> multiprocessing.process.BaseProcess:
    """The process beside, once it is there."""
    while not multiprocessing.active_children():
        time.sleep(0.01)
    return multiprocessing.active_children()[0]


def test_a_take_that_cannot_be_scored_or_drawn_is_told(
    annotator: Annotator, take: Any, told: list[str]
) -> None:
    assert annotator.lacks(take)
    annotator.annotate("trial", take)
    annotator.finish(lambda left: None)
    assert [line.partition(":")[0] for line in told] == [
        "a take was not scored", "a view was not drawn",
    ]  # fmt: skip


def test_a_helper_that_dies_ends_scoring_and_not_the_session(
    annotator: Annotator, stuck: Any, told: list[str]
) -> None:
    annotator.annotate("trial", stuck)
    helper().kill()
    annotator.finish(lambda left: None)
    annotator.annotate("trial", stuck)
    assert "a take was not scored" in told[0] and "neither scored nor drawn" in told[-1]


def test_leaving_waits_for_nothing(annotator: Annotator, stuck: Any) -> None:
    annotator.annotate("trial", stuck)
    process = helper()
    annotator.__exit__(None, None, None)
    assert not process.is_alive()


def test_a_session_that_is_to_end_waits_for_no_score(
    annotator: Annotator, controller: Any, stuck: Any, told: list[str]
) -> None:
    annotator.annotate("trial", stuck)
    left: list[int] = []

    def end(waiting: int) -> None:
        left.append(waiting)
        controller.ending = True

    annotator.finish(end)
    assert left == [1] and told == ["takes without scores yet: 1; --resume scores them"]
