"""A session folder with a small plan, and a controller on it."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from labeling.controller import SessionController
from logs.events import Source
from logs.session import SessionDescriptor, SessionFolder, open_segment
from logs.state import PlannedEntry

SETUP = {"robot": "r1", "camera": "c1", "calibration": "k1", "plan": "p1"}


def describe(trials: int) -> SessionDescriptor:
    return SessionDescriptor(
        created_ns=1,
        seed=7,
        config={"station": "simulated"},
        trials=tuple(
            PlannedEntry(
                number=number,
                trial_id=f"00000000-0000-4000-8000-{number:012d}",
                grasp_id=f"g{number}",
                object_name=("cube", "pawn")[number % 2],
                stable_pose=0,
            )
            for number in range(1, trials + 1)
        ),
        fingerprints=SETUP,
        simulated=True,
    )


@pytest.fixture
def folder(tmp_path: Path) -> SessionFolder:
    return SessionFolder.create(tmp_path / "session", describe(3))


def open_controller(folder: SessionFolder, **options: object) -> SessionController:
    journal = folder.open_journal()
    from logs.state import SessionState

    state = SessionState.fold(folder.descriptor.trials, journal.entries)
    open_segment(journal, state, SETUP, operator="ann", source=Source.OPERATOR)
    return SessionController(journal, state, **options)  # type: ignore[arg-type]


@pytest.fixture
def opened(folder: SessionFolder) -> Iterator[Callable[..., SessionController]]:
    made: list[SessionController] = []

    def make(**options: object) -> SessionController:
        made.append(open_controller(folder, **options))
        return made[-1]

    yield make
    for controller in made:
        controller.close("ended")


@pytest.fixture
def controller(opened: Callable[..., SessionController]) -> SessionController:
    return opened()
