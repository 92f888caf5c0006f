"""The console's HTTP interface: a stream of views, commands in, pictures and recordings out."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator, Callable, Coroutine
from concurrent.futures import ThreadPoolExecutor
from contextlib import asynccontextmanager, suppress
from importlib.resources import files
from typing import Annotated, Any, Final

from fastapi import APIRouter, Body, FastAPI, HTTPException, Query, Request
from fastapi.responses import FileResponse, Response, StreamingResponse

from labeling.control.commands import Answer, Command, CommandKind
from labeling.display.console import Console
from labeling.display.review import Filter, models_scored, review_list
from labeling.display.view import View, console_terms, console_view
from labeling.errors import OutsideSessionError
from labeling.server.access import Access, Gate
from labeling.server.presence import Presence
from labeling.server.recordings import RecordingTickets
from labeling.server.stream import Streams, console_stream
from labeling.server.viewer_assets import ASSETS, ViewerAssetsError, viewer_asset

PAGES: Final = {
    "/": ("index.html", "text/html"),
    "/console.css": ("console.css", "text/css"),
    "/main.js": ("main.js", "text/javascript"),
    "/about.js": ("about.js", "text/javascript"),
    "/actions.js": ("actions.js", "text/javascript"),
    "/buttons.js": ("buttons.js", "text/javascript"),
    "/commands.js": ("commands.js", "text/javascript"),
    "/legend.js": ("legend.js", "text/javascript"),
    "/link.js": ("link.js", "text/javascript"),
    "/keys.js": ("keys.js", "text/javascript"),
    "/draw.js": ("draw.js", "text/javascript"),
    "/review.js": ("review.js", "text/javascript"),
    "/stage.js": ("stage.js", "text/javascript"),
    "/sound.js": ("sound.js", "text/javascript"),
    "/viewer/": ("viewer.html", "text/html"),
    "/viewer/viewer.js": ("viewer.js", "text/javascript"),
}
"""The only files served from the package, by exact address."""


class ConsoleApi:
    """One console's HTTP application.

    Args:
        console: the session and what may be shown of it.
        access: who may talk to it.
    """

    def __init__(self, console: Console, access: Access) -> None:
        self.console = console
        self.presence = Presence(console.controller)
        self._streams = Streams()
        self._tickets = RecordingTickets(console.root) if console.root else None
        # The stop never waits behind other commands for a worker.
        self._stop_worker = ThreadPoolExecutor(1, thread_name_prefix="stop")
        inner = FastAPI(openapi_url=None, docs_url=None, redoc_url=None, lifespan=self._lifespan)
        inner.include_router(self._api_routes())
        inner.include_router(_page_routes())
        inner.include_router(self._viewer_routes())
        self.app = Gate(inner, access)

    def leave(self) -> None:
        """End all streams, so that the server can shut down at once; from its own loop."""
        self._streams.leave()

    @asynccontextmanager
    async def _lifespan(self, app: FastAPI) -> AsyncIterator[None]:
        holds = self.console.hold_without_console and self.console.mode == "run"
        watch = asyncio.create_task(self.presence.watch()) if holds else None
        try:
            yield
        finally:
            if watch is not None:
                watch.cancel()
                with suppress(asyncio.CancelledError):
                    await watch
            self._stop_worker.shutdown(wait=False)

    def _api_routes(self) -> APIRouter:
        routes = APIRouter(prefix="/api")
        routes.get("/terms")(console_terms)
        routes.get("/view")(self._view)
        routes.get("/stream")(self._stream)
        routes.post("/alive")(self._alive)
        routes.post("/commands")(self._command)
        routes.get("/pictures/{trial_id}/{take}/{name}")(self._picture)
        routes.get("/review")(self._review)
        routes.post("/recordings")(self._recording)
        return routes

    def _viewer_routes(self) -> APIRouter:
        routes = APIRouter(prefix="/viewer")
        routes.get("/recording/{ticket}.rrd")(self._ticketed)
        routes.get("/{name}")(_viewer_file)
        return routes

    def _view(self) -> View:
        self.presence.alive()
        return console_view(self.console)

    async def _stream(self) -> StreamingResponse:
        self.presence.alive()
        stream = console_stream(self.console, self._streams)
        return StreamingResponse(stream, media_type="text/event-stream")

    async def _alive(self) -> dict[str, float]:
        self.presence.alive()
        return {"tick": self.console.controller.tick()}

    async def _command(self, command: Annotated[Command, Body()]) -> Answer:
        self.presence.alive()
        if command.tick is None and command.kind is not CommandKind.STOP:
            raise HTTPException(422, "a command echoes the newest tick of the stream")
        if command.kind is CommandKind.STOP:
            loop = asyncio.get_running_loop()
            return await loop.run_in_executor(self._stop_worker, self.console.submit, command)
        return await asyncio.to_thread(self.console.submit, command)

    def _picture(self, trial_id: str, take: int, name: str) -> Response:
        try:
            content = self.console.pictures.draw(trial_id, take, name)
        except (OutsideSessionError, OSError) as error:
            raise HTTPException(404, "there is no such picture") from error
        if content is None:
            raise HTTPException(404, "there is no such picture")
        return Response(content, media_type="image/png")

    def _review(self, wanted: Annotated[Filter, Query()]) -> View:
        second, operator = self.console.second, self.console.actor.operator
        if second and wanted.tells_verdicts:
            raise HTTPException(403, "a second operator does not filter by the first one's verdict")
        with self.console.controller.reading() as state:
            return {
                "found_by": wanted.found_by,
                "models": () if second else models_scored(state),
                "objects": sorted({t.planned.object_name for t in state.trials.values()}),
                "trials": review_list(state, wanted, second=operator if second else None),
            }

    def _recording(self, trial_id: Annotated[str, Body(embed=True)]) -> dict[str, str]:
        with self.console.controller.reading() as state:
            trial = state.trials.get(trial_id)
        path = self.console.recordings(trial) if trial is not None else None
        if path is None or self._tickets is None:
            raise HTTPException(404, "this trial has no recording to look at")
        try:
            return {"path": f"/viewer/recording/{self._tickets.issue(path)}.rrd"}
        except OutsideSessionError as error:
            raise HTTPException(404, "this trial has no recording to look at") from error

    def _ticketed(self, ticket: str) -> FileResponse:
        path = self._tickets.redeem(ticket) if self._tickets else None
        if path is None:
            raise HTTPException(404, "this ticket is not valid, or no longer")
        return FileResponse(path, media_type="application/octet-stream")


def _viewer_file(name: str) -> FileResponse:
    if name not in ASSETS:
        raise HTTPException(404, "there is no such file")
    try:
        path = viewer_asset(name)
    except ViewerAssetsError as error:
        raise HTTPException(503, str(error)) from error
    headers = {"cache-control": "max-age=86400"}
    return FileResponse(path, media_type=ASSETS[name], headers=headers)


def _page_routes() -> APIRouter:
    routes = APIRouter()
    for address, (name, media_type) in PAGES.items():
        routes.get(address)(_page(name, media_type))
    return routes


def _page(name: str, media_type: str) -> Callable[[Request], Coroutine[Any, Any, Response]]:
    content = files("labeling.web").joinpath(name).read_bytes()

    async def page(request: Request) -> Response:
        return Response(content, media_type=media_type)

    return page
