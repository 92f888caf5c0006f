"""The terminal console's way to the server: the same stream and commands as the page."""

from __future__ import annotations

import json
import ssl
import time
import uuid
from collections.abc import AsyncIterator
from pathlib import Path
from typing import Any, Final, NamedTuple
from urllib.parse import parse_qs, urlsplit

import httpx

from labeling.errors import ConsoleLinkError

SILENCE_SECONDS: Final = 1.7
"""Three missed ticks: the connection counts as lost."""
ANSWER_SECONDS: Final = 3.0


class LinkParts(NamedTuple):
    """A console's link, taken apart."""

    origin: str
    headers: dict[str, str]


def link_parts(link: str) -> LinkParts:
    """Take a printed link apart.

    Raises:
        ConsoleLinkError: if it is none, or holds no token.
    """
    parts = urlsplit(link)
    token = parse_qs(parts.fragment).get("token", [""])[0]
    if parts.scheme not in ("http", "https") or not parts.netloc or not token:
        raise ConsoleLinkError(f"{link!r} is no console link; copy it whole, with #token=…")
    return LinkParts(f"{parts.scheme}://{parts.netloc}", {"Authorization": f"Bearer {token}"})


def trusted(certificate: Path | None) -> ssl.SSLContext | bool:
    """Whom a connection trusts: the system's authorities, or one certificate.

    Raises:
        ConsoleLinkError: if the file holds no certificate.
    """
    if certificate is None:
        return True
    try:
        return ssl.create_default_context(cafile=certificate)
    except (OSError, ssl.SSLError) as error:
        raise ConsoleLinkError(f"{certificate} is no TLS certificate (PEM): {error}") from error


def check_link(link: str, *, verify: ssl.SSLContext | bool = True) -> None:
    """Ask a console for one answer, so that a dead link is told before the screen is taken.

    Raises:
        ConsoleLinkError: if there is none; tells what to look at.
    """
    origin, headers = link_parts(link)
    try:
        with httpx.Client(
            headers=headers, timeout=ANSWER_SECONDS, trust_env=False, verify=verify
        ) as client:
            status = client.get(f"{origin}/api/terms").status_code
    except (httpx.HTTPError, httpx.InvalidURL) as error:
        raise ConsoleLinkError(f"no console answers at {origin}: {_why(error)}") from error
    if status == httpx.codes.UNAUTHORIZED:
        raise ConsoleLinkError(
            f"the console at {origin} does not know this token: copy the link of the session that"
            " runs now"
        )
    if status != httpx.codes.OK:
        raise ConsoleLinkError(f"what answers at {origin} is no console (HTTP status {status})")


def _why(error: Exception) -> str:
    text = str(error) or type(error).__name__
    if "CERTIFICATE_VERIFY_FAILED" in text:
        return f"its TLS certificate is not trusted; name it with --certificate ({text})"
    return text


class TerminalLink:
    """A client of one console.

    Args:
        link: the printed link, with the token in its fragment.
        verify: whom to trust, as by `trusted`.

    Raises:
        ConsoleLinkError: if the link is none, or holds no token.
    """

    def __init__(self, link: str, *, verify: ssl.SSLContext | bool = True) -> None:
        origin, headers = link_parts(link)
        self._client = httpx.AsyncClient(
            base_url=origin,
            headers=headers,
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
