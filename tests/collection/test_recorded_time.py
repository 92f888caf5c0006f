"""A simulated session's time: it begins with the session, and never goes back."""

from __future__ import annotations

from pathlib import Path

from collection.cli.main import main
from collection.clock import SimulatedClock
from collection.session.recorded_time import last_recorded_ns
from logs.record.facts import read_facts
from logs.session.folder import SessionFolder

WORDS = "--station simulated --objects cube_3cm --grasps 1 --repeats 1 --seed 8 --operator auto"


def test_records_are_from_the_session_on_and_the_next_sitting_is_later(tmp_path: Path) -> None:
    out = tmp_path / "S"
    assert main(["collect", *WORDS.split(), "--out", str(out), "--no-report"]) == 0
    folder = SessionFolder.open(out)
    records = list(folder.trials.rglob("trial*.mcap"))
    times = [one.execution.time_ns for one in read_facts(records) if one and one.execution]
    assert times
    assert all(time >= folder.descriptor.created_ns for time in times)
    assert last_recorded_ns(out) >= max(times)
    torn = records[0].with_name("trial.torn.mcap")
    torn.write_bytes(records[0].read_bytes()[:-200])
    assert last_recorded_ns(out) >= max(times)  # a torn record hides no other


def test_a_clock_is_never_set_back() -> None:
    clock = SimulatedClock(5)
    clock.begin_at(3)
    assert clock.now_ns() == 5
    clock.begin_at(9)
    assert clock.now_ns() == 9
