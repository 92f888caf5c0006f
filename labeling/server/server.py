"""Runs the console's server in a thread beside the session's loop."""

from __future__ import annotations

import asyncio
import socket
import threading
from contextlib import suppress
from types import TracebackType
from typing import Final, Self

import uvicorn

from labeling.display.console import Console
from labeling.errors import LabelingError
from labeling.server.access import Access
from labeling.server.api import ConsoleApi

START_SECONDS: Final = 15.0


class ConsoleServer:
    """The console's HTTP server; a context manager. Leaving takes well under a second.

    Args:
        console: the session and what may be shown of it.
        access: where to listen; port 0 is not allowed, see [free_port][labeling.server.server.free_port].

    Raises:
        LabelingError: on entering, if the server does not start.
    """

    def __init__(self, console: Console, access: Access) -> None:
        self.access = access
        self._api: ConsoleApi | None = None
        self._console = console
        self._server: uvicorn.Server | None = None
        self._loop: asyncio.AbstractEventLoop | None = None
        self._started = threading.Event()
        self._problem: BaseException | None = None
        self._thread = threading.Thread(target=self._run, name="console server", daemon=True)

    @property
    def link(self) -> str:
        """What the operator opens."""
        return self.access.link

    def __enter__(self) -> Self:
        self._thread.start()
        self._started.wait(START_SECONDS)
        if self._problem is not None or self._server is None or not self._server.started:
            raise LabelingError(
                f"the console's server did not start on {self.access.origin}:"
                f" {self._problem or 'no answer'}"
            )
        return self

    def __exit__(
        self,
        exc_type: type[BaseException] | None,
        exc: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        if self._loop is not None and self._api is not None and self._server is not None:
            self._server.should_exit = True
            with suppress(RuntimeError):  # the loop ended by itself
                self._loop.call_soon_threadsafe(self._api.leave)
        self._thread.join()

    def _run(self) -> None:
        try:
            asyncio.run(self._serve())
        except BaseException as error:
            self._problem = error
        finally:
            self._started.set()

    async def _serve(self) -> None:
        self._loop = asyncio.get_running_loop()
        self._api = ConsoleApi(self._console, self.access)
        bound = _bind(self.access)
        config = uvicorn.Config(
            self._api.app,
            log_level="warning",
            access_log=False,
            ssl_certfile=self.access.certificate,
            ssl_keyfile=self.access.key,
            timeout_graceful_shutdown=1,
            server_header=False,
            proxy_headers=False,
            ws="none",
        )
        self._server = _Server(config, self._started)
        with bound:
            await self._server.serve(sockets=[bound])


class _Server(uvicorn.Server):
    """A server that says when it listens, and leaves the process's signals alone."""

    def __init__(self, config: uvicorn.Config, started: threading.Event) -> None:
        super().__init__(config)
        self._told = started

    async def startup(self, sockets: list[socket.socket] | None = None) -> None:
        await super().startup(sockets)
        self._told.set()


def _bind(access: Access) -> socket.socket:
    family = socket.AF_INET6 if ":" in access.host else socket.AF_INET
    # asyncio switches Nagle's delay (40 ms an answer) off only if the protocol is named here.
    bound = socket.socket(family, socket.SOCK_STREAM, socket.IPPROTO_TCP)
    bound.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    try:
        bound.bind((access.host, access.port))
    except OSError as error:
        bound.close()
        raise LabelingError(f"{access.host}:{access.port} cannot be used: {error}") from error
    return bound


def free_port(host: str = "127.0.0.1") -> int:
    """A port nobody listens on now."""
    family = socket.AF_INET6 if ":" in host else socket.AF_INET
    with socket.create_server((host, 0), family=family) as probe:
        return int(probe.getsockname()[1])
