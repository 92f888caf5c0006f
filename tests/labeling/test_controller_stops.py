"""What halts a session: a stop, a pause, a hold, its end, and a full disk."""

from __future__ import annotations

import threading
from typing import Any

import pytest

from labeling.control.commands import Actor
from labeling.errors import SessionEndingError, TakeEndedError
from logs.errors import DiskFullError
from logs.journal.events import Phase, Source

BOB = Actor("bob", Source.OPERATOR)


def test_a_stop_acts_before_the_lock_and_while_someone_holds_it(make_bench: Any) -> None:
    stopped = threading.Event()
    bench = make_bench(stop=stopped.set)
    command = bench.command("stop")
    presser = threading.Thread(target=bench.controller.submit, args=(command, BOB))
    with bench.controller.reading():  # the lock is taken
        presser.start()
        assert stopped.wait(60)
        assert not bench.state.stopped  # acted, not yet logged
    presser.join()
    assert bench.state.stopped


def test_while_stopped_only_the_stop_can_be_cleared(bench: Any) -> None:
    bench.labelled()
    bench.executed()
    bench.do("stop")
    for kind, number, value in [
        ("label", 2, {"outcome": "success"}),
        ("relabel", 1, {"outcome": "success"}),
        ("undo", 1, {}),
        ("skip", 2, {}),
        ("redo", 2, {"cause": "moving"}),
        ("pause", None, {}),
    ]:
        assert "stopped" in bench.do(kind, number, **value).message
    assert bench.do("clear_stop").status == "rejected"
    assert bench.do("clear_stop", confirm=True).status == "stored"
    assert bench.do("label", 2, outcome="success").status == "stored"


def test_clearing_an_earlier_stop_does_not_clear_a_later_one(bench: Any) -> None:
    bench.do("stop")
    early = bench.command("clear_stop", confirm=True)
    bench.do("stop")
    assert bench.controller.submit(early, BOB).status == "stale"
    assert bench.state.stopped


def test_a_stop_that_does_not_reach_the_robot_is_said_and_logged(make_bench: Any) -> None:
    def broken() -> None:
        raise ConnectionError("no route")

    bench = make_bench(stop=broken)
    answer = bench.do("stop")
    assert "DID NOT REACH THE ROBOT" in answer.message
    assert bench.state.stopped


def test_a_stop_during_the_motion_voids_the_take_even_if_cleared_at_once(bench: Any) -> None:
    take = bench.begin()
    bench.do("placed", 1)
    take.advance(Phase.EXECUTE)
    bench.do("stop")
    bench.do("clear_stop", confirm=True)
    with pytest.raises(TakeEndedError, match="software stop"):
        take.record_executed("r", None)  # type: ignore[arg-type]
    assert bench.trial(1).takes[0].status == "voided"
    assert bench.begin().number == 2


def test_a_pause_holds_the_next_phase_and_the_next_trial(bench: Any, in_thread: Any) -> None:
    take = bench.begin()
    bench.do("placed", 1)
    bench.do("pause")
    waiting = in_thread(lambda: take.advance(Phase.CAPTURE))
    assert bench.trial(1).takes[0].phase is Phase.PLACE_OBJECT
    bench.do("resume")
    waiting()
    assert bench.trial(1).takes[0].phase is Phase.CAPTURE


def test_a_label_is_welcome_in_a_pause(bench: Any) -> None:
    bench.executed()
    bench.do("pause")
    assert bench.do("label", 1, outcome="success").status == "stored"


def test_a_hold_ends_with_its_own_cause_only(bench: Any, in_thread: Any) -> None:
    bench.controller.hold("camera", "no image for 5 s")
    bench.controller.hold("console", "nobody is connected")
    waiting = in_thread(bench.controller.next_work)
    bench.controller.release("console")
    assert bench.state.holds == {"camera": "no image for 5 s"}
    assert not bench.controller.may_move
    bench.controller.release("camera")
    assert waiting().planned.number == 1


def test_the_session_ends_at_once_wherever_it_waits(bench: Any, in_thread: Any) -> None:
    waiting = in_thread(bench.begin().wait_placed)
    bench.controller.request_end()
    with pytest.raises(SessionEndingError):
        waiting()
    assert bench.controller.next_work() is None
    bench.controller.close("ended")
    assert bench.do("pause").message == "the session has ended"


def test_a_full_disk_ends_the_session_before_the_next_trial(make_bench: Any) -> None:
    left = iter([60, 2, 1])
    bench = make_bench(trials_left=lambda: next(left))
    assert not bench.controller.disk.low
    bench.labelled()
    assert bench.controller.disk.low
    with pytest.raises(DiskFullError, match="room for 1 more .* --resume"):
        bench.controller.next_work()


def test_a_label_that_cannot_be_stored_is_not_acknowledged(
    bench: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    bench.executed()
    monkeypatch.setattr("os.write", lambda fd, data: 0)
    answer = bench.do("label", 1, outcome="success")
    monkeypatch.undo()
    assert answer.status == "rejected"
    assert "not stored" in answer.message
    assert bench.trial(1).status == "unlabelled"
    assert bench.do("label", 1, outcome="success").status == "stored"
