"""kill -9 at random moments of a simulated session: nothing stored is lost, nothing invented."""

from __future__ import annotations

import os
import random
import signal
import subprocess
import sys
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest

from logs.journal.file import JOURNAL_NAME, read_journal
from logs.session.folder import SESSION_NAME, SessionFolder

TRIALS = 40
SCRIPT = Path(__file__).with_name("fake_session.py")
ROOT = Path(__file__).parents[2]


def start(folder: Path) -> subprocess.Popen[bytes]:
    with folder.with_suffix(".errors").open("wb") as errors:
        return subprocess.Popen(
            [sys.executable, str(SCRIPT), str(folder), str(TRIALS)],
            env={**os.environ, "PYTHONPATH": str(ROOT)},
            stdout=subprocess.DEVNULL,
            stderr=errors,
        )


def kill_once_grown(process: subprocess.Popen[bytes], journal: Path, size: int) -> bool:
    """Kill the process as soon as its journal has that many bytes; False if it ended first."""
    while process.poll() is None:
        if journal.exists() and journal.stat().st_size >= size:
            os.kill(process.pid, signal.SIGKILL)
            process.wait()
            return True
    return False


def stored_labels(journal: Path) -> dict[int, tuple[str, Any]]:
    return {
        entry.seq: (entry.event.trial_id, entry.event.outcome)  # type: ignore[union-attr]
        for entry in read_journal(journal)
        if entry.event.kind == "label"
    }


@pytest.mark.slow
def test_a_session_survives_kills_at_random_moments(
    tmp_path: Path, fake_session: ModuleType
) -> None:
    kills = 50 if os.environ.get("REACH_SLOW") else 8
    rng = random.Random(5)
    folder, sessions = tmp_path / "session0", 0
    journal = folder / JOURNAL_NAME
    for _ in range(kills):
        labels = stored_labels(journal) if journal.exists() else {}
        plan = (folder / SESSION_NAME).read_bytes() if folder.exists() else None
        size = journal.stat().st_size if journal.exists() else 0
        # Some kills come at once, before the resumed process has written anything.
        grown = size + rng.choice([0, 1, rng.randrange(12_000)])
        killed = kill_once_grown(start(folder), journal, grown)
        assert labels.items() <= stored_labels(journal).items()
        assert plan in (None, (folder / SESSION_NAME).read_bytes())
        if not killed:
            check_whole(SessionFolder.open(folder), fake_session)
            sessions += 1
            folder = tmp_path / f"session{sessions}"
            journal = folder / JOURNAL_NAME
    process = start(folder)
    assert process.wait(60) == 0, folder.with_suffix(".errors").read_text()
    check_whole(SessionFolder.open(folder), fake_session)


def check_whole(folder: SessionFolder, fake_session: ModuleType) -> None:
    """Every planned trial has the one label that its outcome asks for."""
    assert folder.descriptor == fake_session.describe(TRIALS)
    state = folder.read_state()
    counts = state.counts()
    assert (counts.planned, counts.labelled, counts.unlabelled) == (TRIALS, TRIALS, 0)
    for trial in state.order:
        truth = fake_session.truth_of(trial.planned.number)
        assert trial.label is not None and trial.valid_take is not None
        assert trial.label.outcome is truth.outcome
        assert trial.label.source == "operator_sim"
        assert (folder.path / str(trial.valid_take.record)).read_bytes() == b"record"
    labelled = [
        (entry.event.trial_id, entry.event.take)  # type: ignore[union-attr]
        for entry in read_journal(folder.journal_path)
        if entry.event.kind == "label"
    ]
    assert len(set(labelled)) == len(labelled) == TRIALS
    order = [
        entry.event.trial_id  # type: ignore[union-attr]
        for entry in read_journal(folder.journal_path)
        if entry.event.kind == "executed"
    ]
    assert order == [trial.trial_id for trial in state.order]


def test_a_label_that_was_executed_but_not_stored_is_asked_for_again(
    tmp_path: Path, fake_session: ModuleType, make_bench: Any, bench: Any
) -> None:
    take = bench.executed()
    bench.controller.close(None)  # what a kill leaves: no event says the session ended
    again = make_bench()
    work = again.controller.next_work()
    resumed = again.controller.begin(work)
    assert (resumed.trial_id, resumed.number, resumed.executed) == (take.trial_id, 1, True)


def test_a_take_that_was_under_way_is_interrupted_and_taken_again(
    make_bench: Any, bench: Any
) -> None:
    bench.begin()
    bench.do("placed", 1)
    bench.controller.close(None)
    again = make_bench()
    assert again.trial(1).takes[0].status == "interrupted"
    assert again.begin().number == 2
    assert again.state.counts().voided == 1
