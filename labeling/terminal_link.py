"""The terminal console's way to the server: the same stream and commands as the page."""

from __future__ import annotations

import json
import time
import uuid
from collections.abc import AsyncIterator
from typing import Any, Final
from urllib.parse import parse_qs, urlsplit

import httpx

from labeling.errors import LabelingError

SILENCE_SECONDS: Final = 1.7
"""Three missed ticks: the connection counts as lost."""
ANSWER_SECONDS: Final = 3.0


class TerminalLink:
    """A client of one console.

    Args:
        link: the printed link, with the token in its fragment.
        verify: path of a certificate to trust, or True for the system's.

    Raises:
        LabelingError: if the link holds no token.
    """

    def __init__(self, link: str, *, verify: str | bool = True) -> None:
        parts = urlsplit(link)
        token = parse_qs(parts.fragment).get("token", [""])[0]
        if not parts.scheme or not token:
            raise LabelingError(f"{link!r} is no console link; copy it whole, with #token=…")
        self._client = httpx.AsyncClient(
            base_url=f"{parts.scheme}://{parts.netloc}",
            headers={"Authorization": f"Bearer {token}"},
            timeout=ANSWER_SECONDS,
            trust_env=False,
            verify=verify,
        )
        self.tick: float | None = None
        self._heard = -float("inf")

    @property
    def alive(self) -> bool:
        """True while the server's ticks arrive."""
        return time.monotonic() - self._heard < SILENCE_SECONDS

    async def terms(self) -> dict[str, Any]:
        """The words and keys."""
        answer = (await self._client.get("/api/terms")).raise_for_status()
        return dict(answer.json())

    async def views(self) -> AsyncIterator[dict[str, Any]]:
        """Views, as they arrive, until the stream ends.

        Raises:
            httpx.HTTPError: if the connection is lost.
        """
        limits = httpx.Timeout(ANSWER_SECONDS, read=2 * SILENCE_SECONDS)
        async with self._client.stream("GET", "/api/stream", timeout=limits) as stream:
            stream.raise_for_status()
            event, view = "", {}
            async for line in stream.aiter_lines():
                if line.startswith("event: "):
                    event = line.removeprefix("event: ")
                elif line.startswith("data: "):
                    data = json.loads(line.removeprefix("data: "))
                    self.tick, self._heard = data["tick"], time.monotonic()
                    if event == "state":
                        view = data
                        yield view
                    elif event == "end" and view:
                        view = {**view, "state": "ENDED"}
                        yield view

    async def say_alive(self) -> None:
        """Give a sign of life; a lost connection shows in the stream."""
        try:
            await self._client.post("/api/alive", json={})
        except httpx.HTTPError:
            return

    async def send(self, command: dict[str, Any]) -> dict[str, Any]:
        """Send a command; status `unconfirmed` if there is no answer."""
        body = {"id": str(uuid.uuid4()), "tick": self.tick, **command}
        try:
            answer = await self._client.post("/api/commands", json=body)
            content = answer.json()
        except (httpx.HTTPError, ValueError):
            return {"status": "unconfirmed", "id": body["id"]}
        if answer.status_code != 200:
            return {"status": "rejected", "message": str(content.get("detail")), "id": body["id"]}
        return {**content, "id": body["id"]}

    async def close(self) -> None:
        """Close the connections."""
        await self._client.aclose()
