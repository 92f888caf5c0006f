"""The terminal console under Textual's pilot, on a real server."""

from __future__ import annotations

import asyncio
import contextvars
from collections.abc import Awaitable, Callable
from typing import Any

import pytest

from labeling.errors import LabelingError
from labeling.terminal.app import TerminalConsole
from labeling.terminal.link import TerminalLink

Steps = Callable[[TerminalConsole, Any], Awaitable[None]]


async def until(app: TerminalConsole, condition: Callable[[], bool]) -> None:
    async with asyncio.timeout(60):
        while not condition():
            await asyncio.sleep(0.02)


def shown(app: TerminalConsole, name: str) -> str:
    return str(app.query_one(f"#{name}").render())


def operate(link: str, steps: Steps) -> None:
    async def run() -> None:
        app = TerminalConsole(TerminalLink(link))
        async with app.run_test(size=(120, 40)) as pilot:
            await until(app, lambda: bool(app._view and app._terms))
            await steps(app, pilot)

    asyncio.run(run())


def test_keys_label_and_undo(bench: Any, serve: Any) -> None:
    async def steps(app: TerminalConsole, pilot: Any) -> None:
        await until(app, lambda: app._target() is not None)
        await pilot.press("t", "s")
        await until(app, lambda: "trial 1: success" in shown(app, "receipt"))
        assert bench.trial(1).label.rotated
        await pilot.press("u")
        await until(app, lambda: "Label trial 1 again" in shown(app, "banner"))
        await pilot.press("f", "3")
        await until(app, lambda: bench.trial(1).label is not None)
        assert bench.trial(1).label.reason == "dropped_while_held"

    bench.executed()
    operate(serve(bench).link, steps)


def test_a_note_is_typed_and_goes_with_the_label(bench: Any, serve: Any) -> None:
    async def steps(app: TerminalConsole, pilot: Any) -> None:
        await until(app, lambda: app._target() is not None)
        await pilot.press("n", *"fuss", "enter", "s")
        await until(app, lambda: bench.trial(1).label is not None)
        assert bench.trial(1).label.note == "fuss"

    bench.executed()
    operate(serve(bench).link, steps)


def test_escape_stops_also_while_typing_and_is_cleared_in_two_steps(bench: Any, serve: Any) -> None:
    async def steps(app: TerminalConsole, pilot: Any) -> None:
        await pilot.press("n", "a", "escape")
        await until(app, lambda: bench.state.stopped)
        await until(app, lambda: "STOPPED" in shown(app, "banner"))
        await pilot.press("enter", "c")
        assert bench.state.stopped
        await until(app, lambda: len(app.offered()) == 1)
        await pilot.press("1")
        await until(app, lambda: not bench.state.stopped)

    bench.executed()
    operate(serve(bench).link, steps)


def test_placing_redo_skip_and_pause(bench: Any, serve: Any) -> None:
    async def steps(app: TerminalConsole, pilot: Any) -> None:
        await until(app, lambda: "Place" in shown(app, "banner"))
        await pilot.press("enter")
        await until(app, lambda: bench.trial(1).takes[0].placed)
        await until(app, lambda: "stored: placed" in shown(app, "receipt"))
        await pilot.press("p")
        await until(app, lambda: bench.state.paused)
        await until(app, lambda: bool(app._view and app._view["paused"]))
        await pilot.press("p")
        await until(app, lambda: not bench.state.paused)
        await pilot.press("r", "1")
        await until(app, lambda: bench.trial(1).takes[0].status == "redone")
        await until(app, lambda: "taken again" in shown(app, "receipt"))
        await pilot.press("k", "1")
        await until(app, lambda: bench.trial(1).skipped)

    bench.begin()
    operate(serve(bench).link, steps)


def test_a_lost_connection_shows_and_sends_nothing(bench: Any, serve: Any) -> None:
    server = serve(bench)

    async def steps(app: TerminalConsole, pilot: Any) -> None:
        await until(app, lambda: app._target() is not None)
        await asyncio.to_thread(server.__exit__, None, None, None)
        await until(app, lambda: "CONNECTION LOST" in shown(app, "banner"))
        await pilot.press("s")
        await until(app, lambda: "nothing was sent" in shown(app, "receipt"))

    bench.executed()
    operate(server.link, steps)
    assert bench.trial(1).label is None


def test_a_view_that_arrives_while_the_screen_is_taken_down_harms_nothing(
    bench: Any, serve: Any
) -> None:
    bench.executed()
    link = serve(bench).link

    async def run() -> None:
        app = TerminalConsole(TerminalLink(link))
        async with app.run_test(size=(120, 40)):
            await until(app, lambda: bool(app._view and app._terms))
            await app.screen.query("*").remove()
            app._take_in(dict(app._view or {}))
            await app._act("s")
            context = contextvars.copy_context()
        context.run(app._take_in, dict(app._view or {}))  # as the worker would, a moment too late

    asyncio.run(run())
    assert bench.trial(1).label is not None


def test_no_prediction_before_the_label(bench: Any, serve: Any) -> None:
    async def steps(app: TerminalConsole, pilot: Any) -> None:
        await until(app, lambda: app._target() is not None)
        assert "0.43" not in str(app._view)
        await pilot.press("s")
        await until(app, lambda: "0.4321" in str(app._view["history"]))

    bench.executed()
    bench.score(1, 0.4321)
    operate(serve(bench).link, steps)


def test_a_link_without_its_token_is_refused() -> None:
    with pytest.raises(LabelingError, match="token"):
        TerminalLink("http://127.0.0.1:8000/")


def test_the_session_s_lines_are_shown_and_its_end_ends_the_console(bench: Any, serve: Any) -> None:
    lines = ["the first line", *(f"line {n}" for n in range(4))]
    over: list[bool] = []

    async def run() -> None:
        app = TerminalConsole(TerminalLink(serve(bench).link), lines, over=lambda: bool(over))
        async with app.run_test(size=(120, 40)):
            await until(app, lambda: bool(app._view))
            assert "line 3" in shown(app, "lines") and "first" not in shown(app, "lines")
            lines.append("void: [out of reach]")
            await until(app, lambda: "[out of reach]" in shown(app, "lines"))
            over.append(True)
            await until(app, lambda: app._exit)

    bench.executed()
    asyncio.run(run())


def test_what_was_begun_for_one_take_never_ends_up_on_another(bench: Any, serve: Any) -> None:
    async def steps(app: TerminalConsole, pilot: Any) -> None:
        await until(app, lambda: app._target() is not None)
        await pilot.press("t", "f")
        await until(app, lambda: len(app.offered()) > 3 and app._rotated)
        bench.do("label", 1, outcome="success")  # another console was faster
        bench.executed()
        await until(app, lambda: bool(app._target() and app._target()["number"] == 2))
        await pilot.press("1", "s")
        await until(app, lambda: bench.trial(2).label is not None)
        assert (bench.trial(2).label.outcome, bench.trial(2).label.rotated) == ("success", False)

    bench.executed()
    operate(serve(bench).link, steps)
