"""The robot follows again only after a person's clear, and never past a stop pressed meanwhile."""

from __future__ import annotations

import threading
from typing import Any

from labeling.control.commands import Actor
from labeling.control.stop_count import StopCount
from logs.journal.events import Source

ANN = Actor("ann", Source.OPERATOR)


def test_clearing_the_stop_releases_the_robot_and_nothing_else_does(make_bench: Any) -> None:
    done: list[str] = []
    bench = make_bench(stop=lambda: done.append("stop"))
    bench.controller.releases_with(lambda: done.append("release"))
    bench.do("stop")
    bench.do("resume")
    bench.do("clear_stop")  # not confirmed
    assert done == ["stop"]
    bench.do("clear_stop", confirm=True)
    assert done == ["stop", "release"]


def test_nothing_may_move_from_the_press_on(make_bench: Any) -> None:
    may_move: list[bool] = []
    bench = make_bench(stop=lambda: may_move.append(bench.controller.may_move))
    assert bench.controller.may_move
    bench.do("stop")
    assert may_move == [False]


def test_a_stop_sent_again_after_its_clear_can_be_cleared_again(make_bench: Any) -> None:
    """A page that repeats a stop has stopped the robot again: the session must know."""
    done: list[str] = []
    bench = make_bench(stop=lambda: done.append("stop"))
    bench.controller.releases_with(lambda: done.append("release"))
    stop = bench.command("stop")
    for _ in range(2):
        bench.controller.submit(stop, ANN)
        assert bench.state.stopped
        bench.do("clear_stop", confirm=True)
    assert done == ["stop", "release"] * 2


def test_a_clear_that_crosses_a_stop_does_not_release_it() -> None:
    count, released = StopCount(), []
    with count.pressed():
        count.unless_pressed(lambda: released.append(1))
        assert count.under_way
    assert not released
    count.unless_pressed(lambda: released.append(1))
    assert released and not count.under_way


def test_stops_from_several_threads_are_all_counted() -> None:
    count = StopCount()
    inside, leave = threading.Barrier(3), threading.Event()

    def press() -> None:
        with count.pressed():
            inside.wait(60)
            leave.wait(60)

    threads = [threading.Thread(target=press) for _ in range(2)]
    for thread in threads:
        thread.start()
    inside.wait(60)
    assert count.under_way
    leave.set()
    for thread in threads:
        thread.join()
    assert not count.under_way
