"""The stream of server-sent events: the newest view after every change, and a steady tick."""

from __future__ import annotations

import asyncio
import json
from collections.abc import AsyncIterator
from contextlib import suppress
from typing import Final

from labeling.display.console import Console
from labeling.display.view import console_view

TICK_PERIOD: Final = 0.5
"""Seconds between ticks; a console that misses several shows red and sends nothing."""
VIEW_GAP: Final = 0.04
"""Seconds from a change to its view: changes come in bursts, each view costs the server and the
page, and a command's answer goes out before the view that it brings about is drawn."""


def _message(event: str, data: object) -> bytes:
    return f"event: {event}\ndata: {json.dumps(data, separators=(',', ':'))}\n\n".encode()


class Streams:
    """The streams of one server, so that all can be ended at once when it shuts down."""

    def __init__(self) -> None:
        self.leaving = False
        self.wakers: set[asyncio.Event] = set()

    def leave(self) -> None:
        """End all streams; from the server's own loop."""
        self.leaving = True
        for waker in self.wakers:
            waker.set()


async def console_stream(console: Console, streams: Streams) -> AsyncIterator[bytes]:
    """Yield messages until the session or the server ends.

    Args:
        console: what is shown.
        streams: the server's streams; this one joins them.
    """
    loop = asyncio.get_running_loop()
    changed = asyncio.Event()
    streams.wakers.add(changed)

    def wake() -> None:
        with suppress(RuntimeError):  # the loop is closed: nobody listens any more
            loop.call_soon_threadsafe(changed.set)

    forget = console.controller.listen(wake)
    try:
        shown = -1
        while not streams.leaving:
            if shown >= 0 and console.controller.version != shown:
                await asyncio.sleep(VIEW_GAP)
            changed.clear()
            closed = console.controller.closed  # asked first: the last view tells of the end
            if console.controller.version != shown:
                view = await asyncio.to_thread(console_view, console)
                shown = view["version"]
                yield _message("state", view)
            else:
                yield _message("tick", {"tick": console.controller.tick(), "version": shown})
            if closed:
                return
            with suppress(TimeoutError):
                await asyncio.wait_for(changed.wait(), TICK_PERIOD)
        if console.controller.ending:  # in order: no console need fear for its connection
            yield _message("end", {"tick": console.controller.tick()})
    finally:
        streams.wakers.discard(changed)
        forget()
