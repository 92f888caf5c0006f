"""SIGKILL at moments spread over a real simulated session: nothing lost, nothing invented.

REACH_KILLS says how often (3 by default); REACH_KILL_SEED chooses other moments.
"""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from collections import Counter
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from logs.journal.events import Executed, Labelled, Scored
from logs.journal.file import JOURNAL_NAME, scan_journal
from logs.record.annotation_files import read_annotations
from logs.record.trial_record import read_record
from logs.session.folder import SessionFolder
from reach.models.names import ANALYTIC_NAMES

REACH = Path(sys.executable).with_name("reach")
KILLS = int(os.environ.get("REACH_KILLS", "3"))
SEED = int(os.environ.get("REACH_KILL_SEED", "1"))
GRASPS = max(2, KILLS // 8)
PLAN = ["--objects", "cube_3cm,bracket", "--grasps", str(GRASPS), "--repeats", "1", "--seed", "11"]
PATIENCE = 400.0
MOST_LINES = 30
"""Journal lines that a sitting may add before it is killed: about two trials and their scores."""
REPORT_SECONDS = 8.0


class Sitting:
    """One process of `reach collect`, from its start to its violent end.

    Args:
        out: the session's folder; resumed if it is there.
    """

    def __init__(self, out: Path) -> None:
        self._journal = out / JOURNAL_NAME
        self._lines_before = self._lines()
        arguments = ["--resume"] if out.exists() else [*PLAN, "--operator", "auto"]
        self._process = subprocess.Popen(
            [REACH, "collect", "--out", str(out), *arguments],
            stdout=subprocess.DEVNULL,
            stderr=subprocess.PIPE,
            text=True,
            start_new_session=True,
        )

    def wait(self, condition: Callable[[], bool] = lambda: False) -> bool:
        """Wait for a condition; False if the process ended by itself first."""
        deadline = time.monotonic() + PATIENCE
        while self._process.poll() is None:
            if condition():
                return True
            assert time.monotonic() < deadline, "nothing happened in time"
            time.sleep(0.01)
        return False

    def wait_lines(self, count: int) -> bool:
        """Wait until the sitting has added lines to the journal."""
        return self.wait(lambda: self._lines() >= self._lines_before + count)

    def wait_seconds(self, seconds: float) -> bool:
        end = time.monotonic() + seconds
        return self.wait(lambda: time.monotonic() >= end)

    def wait_closed(self) -> bool:
        """Wait until the journal is closed: what follows is the report."""
        return self.wait(
            lambda: self._lines() > self._lines_before and b"session_closed" in self._last_line()
        )

    def kill(self) -> None:
        """Kill the process; its helper processes must leave by themselves."""
        self._process.send_signal(signal.SIGKILL)
        self._process.communicate()
        deadline = time.monotonic() + 60
        while self._helpers_live():
            assert time.monotonic() < deadline, "a helper process outlives the session"
            time.sleep(0.05)

    def finish(self) -> None:
        """Let it end by itself."""
        _, complaint = self._process.communicate(timeout=PATIENCE)
        assert self._process.returncode == 0, complaint

    def _helpers_live(self) -> bool:
        try:
            os.killpg(self._process.pid, 0)
        except ProcessLookupError:
            return False
        return True

    def _lines(self) -> int:
        return self._journal.read_bytes().count(b"\n") if self._journal.exists() else 0

    def _last_line(self) -> bytes:
        return self._journal.read_bytes().rstrip(b"\n").rpartition(b"\n")[2]


class Truth:
    """What has been seen in the journal, and must be in it for ever."""

    def __init__(self, plan: str) -> None:
        self.plan = plan
        self.session_id: str | None = None
        self.entries: tuple[Any, ...] = ()

    def check(self, out: Path) -> str:
        """Check a session that was just killed; returns the kind of its last event."""
        folder = SessionFolder.open(out)
        assert self.session_id in (None, folder.descriptor.session_id), "another session"
        self.session_id = folder.descriptor.session_id
        assert json.loads(folder.plan_path.read_text()) == json.loads(self.plan)
        scan = scan_journal(folder.journal_path)
        assert not scan.bad
        assert scan.entries[: len(self.entries)] == self.entries, "a stored event is gone"
        self.entries = scan.entries
        self._check_labels(folder)
        return scan.entries[-1].event.kind

    def _check_labels(self, folder: SessionFolder) -> None:
        """Each label follows the execution of its take, and says what the simulation saw."""
        executed: dict[tuple[str, int], Executed] = {}
        labelled = Counter[tuple[str, int]]()
        for entry in self.entries:
            match entry.event:
                case Executed() as event:
                    executed[event.trial_id, event.take] = event
                case Labelled() as event:
                    labelled[event.trial_id, event.take] += 1
                    truth = executed[event.trial_id, event.take].sensor.truth
                    assert truth is not None, "a label that nobody could have given"
                    assert (event.outcome, event.rotated, event.reason) == (
                        truth.outcome, truth.rotated, truth.reason,
                    )  # fmt: skip
        assert set(labelled.values()) <= {1}
        for event in executed.values():
            assert read_record((folder.path / event.record).parent, images=False).complete


@pytest.mark.slow
@pytest.mark.timeout(KILLS * PATIENCE)
def test_killed_anywhere_the_session_loses_nothing_and_invents_nothing(
    tmp_path: Path, record_property: Callable[[str, object], None]
) -> None:
    out = tmp_path / "S"
    rng = np.random.default_rng(SEED)
    dry = subprocess.run(
        [REACH, "collect", *PLAN, "--operator", "auto", "--out", str(out), "--dry-run", "--json"],
        capture_output=True, text=True, check=True,
    )  # fmt: skip
    truth = Truth(dry.stdout)
    moments = Counter[str]()
    early, late = max(1, KILLS // 6), max(1, KILLS // 6)
    planning_seconds = _planning_seconds(tmp_path / "timed")
    for n in range(KILLS):
        sitting = Sitting(out)
        if n < early and not out.exists():
            struck = sitting.wait_seconds(rng.uniform(0, planning_seconds))
        elif n < KILLS - late:
            lines = int(rng.integers(1, MOST_LINES))
            struck = sitting.wait_lines(lines) and sitting.wait_seconds(rng.exponential(0.3))
        else:
            struck = sitting.wait_closed() and sitting.wait_seconds(rng.uniform(0, REPORT_SECONDS))
        sitting.kill()
        last = truth.check(out) if out.exists() else "no folder yet"
        moments[last if struck else f"{last}, after the end"] += 1
        report = out / "report.html"
        assert not report.exists() or report.read_text().rstrip().endswith("</html>")
    Sitting(out).finish()
    truth.check(out)
    record_property("moments", dict(moments))
    print(json.dumps(moments), flush=True)
    _check_whole(out)


def _planning_seconds(out: Path) -> float:
    """How long a start takes here and now, until the folder appears."""
    begun = time.monotonic()
    sitting = Sitting(out)
    assert sitting.wait(out.exists)
    seconds = time.monotonic() - begun
    sitting.kill()
    return seconds


def _check_whole(out: Path) -> None:
    """Every trial is labelled once and scored by every model; files beside say the same."""
    folder = SessionFolder.open(out)
    state = folder.read_state()
    assert state.counts().labelled == state.counts().planned == 2 * GRASPS
    scored = Counter[tuple[str, int, str]]()
    for entry in scan_journal(folder.journal_path).entries:
        if isinstance(entry.event, Scored):
            scored[entry.event.trial_id, entry.event.take, entry.event.model] += 1
    for trial in state.order:
        take = trial.valid_take
        assert take is not None and take.record is not None and trial.label is not None
        assert {m for t, n, m in scored if (t, n) == (trial.trial_id, take.take)} == set(
            ANALYTIC_NAMES
        )
        beside = (out / take.record).parent
        found = read_annotations(beside)
        assert not found.damaged
        assert found.label is not None and found.label.outcome == trial.label.outcome
        assert {score.model for score in found.scores} == set(ANALYTIC_NAMES)
        assert (beside / "trial.rrd").exists()
    assert set(scored.values()) == {1}, "a take was scored twice by a model"
    assert (out / "report.html").exists()
    hidden = [path.name for path in out.parent.glob(f".{out.name}.new-*")]
    assert not hidden, "an unfinished folder was left behind"
    assert not [*out.rglob(".*.rrd.*")], "an unfinished view was left behind"
