"""Who may talk to the console: this machine's page with the session's token, and nobody else."""

from __future__ import annotations

import ipaddress
import secrets
import ssl
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from starlette.datastructures import Headers, MutableHeaders
from starlette.responses import JSONResponse
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from labeling.errors import UnsafeAddressError

BODY_LIMIT: Final = 16 * 1024


@dataclass(frozen=True, slots=True)
class Access:
    """Where the console listens, and what it demands.

    Args:
        host: address to bind.
        port: port to bind.
        token: secret every request to the API carries.
        certificate: TLS certificate (PEM), needed for another address than this machine's.
        key: its private key (PEM).
    """

    host: str
    port: int
    token: str
    certificate: Path | None = None
    key: Path | None = None

    @property
    def scheme(self) -> str:
        """`https` with a certificate, else `http`."""
        return "https" if self.certificate else "http"

    @property
    def origin(self) -> str:
        """The one origin whose pages may use the API."""
        return f"{self.scheme}://{_bracketed(self.host)}:{self.port}"

    @property
    def viewer_origin(self) -> str:
        """Another site of the same server: the embedded view gets a process of its own."""
        name = "localhost" if is_loopback(self.host) else self.host
        return f"{self.scheme}://{_bracketed(name)}:{self.port}"

    @property
    def link(self) -> str:
        """What the operator opens; the token is in the fragment, which no server ever sees."""
        return f"{self.origin}/#token={self.token}"


def make_access(
    host: str,
    port: int,
    *,
    token: str | None = None,
    certificate: Path | None = None,
    key: Path | None = None,
) -> Access:
    """Decide how the console is reached.

    Args:
        host: address to bind; this machine's own needs nothing more.
        port: port to bind.
        token: secret of the session; a random one if None, which is refused beyond loopback.
        certificate: TLS certificate (PEM).
        key: its private key (PEM).

    Raises:
        UnsafeAddressError: if others could reach the console without a token and TLS, or the
            certificate and its key cannot be used.
    """
    if (certificate is None) != (key is None):
        raise UnsafeAddressError("TLS needs both a certificate and its key")
    if certificate is not None and key is not None:
        _check_pair(certificate, key)
    if not is_loopback(host) and (token is None or certificate is None):
        raise UnsafeAddressError(
            f"the console on {host} could be reached by others: give a token and a TLS"
            f" certificate, or stay on 127.0.0.1 and use ssh -L {port}:127.0.0.1:{port}"
        )
    if token is not None and len(token) < 16:
        raise UnsafeAddressError(
            f"a token of {len(token)} characters can be guessed; use 16 or more"
        )
    return Access(host, port, token or secrets.token_urlsafe(24), certificate, key)


def _check_pair(certificate: Path, key: Path) -> None:
    """Look at the files before a session begins that could not serve its page."""
    for path in (certificate, key):
        if not path.is_file():
            raise UnsafeAddressError(f"{path} is no file")
    try:
        ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER).load_cert_chain(certificate, key, password="")
    except (OSError, ValueError) as error:
        raise UnsafeAddressError(
            f"{certificate} and {key} are no certificate and its unencrypted key: {error}"
        ) from error


def is_loopback(host: str) -> bool:
    """True if only this machine can reach the address."""
    if host == "localhost":
        return True
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return False


def _bracketed(host: str) -> str:
    return f"[{host}]" if ":" in host else host


class Gate:
    """ASGI middleware: checks host, origin, token, content type and size, and adds headers.

    Args:
        app: what it protects.
        access: what it demands.
    """

    def __init__(self, app: ASGIApp, access: Access) -> None:
        self._app = app
        self._access = access
        self._hosts = {origin.split("//")[1] for origin in (access.origin, access.viewer_origin)}
        self._page_policy = _page_policy(access.viewer_origin)
        self._viewer_policy = _viewer_policy(access.origin)

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Answer a refused request here, pass the others on."""
        if scope["type"] == "lifespan":
            await self._app(scope, receive, send)
            return
        refusal = self._refusal(scope)
        if refusal is not None:
            await refusal(scope, receive, self._with_headers(scope, send))
            return
        await self._app(scope, _limited(receive), self._with_headers(scope, send))

    def _refusal(self, scope: Scope) -> JSONResponse | None:
        if scope["type"] != "http":
            return JSONResponse({"detail": "only HTTP is spoken here"}, 400)
        headers = Headers(scope=scope)
        if headers.get("host", "") not in self._hosts:
            return JSONResponse({"detail": "wrong host"}, 400)
        is_api = scope["path"].startswith("/api/")
        if not is_api:
            return None
        origin = headers.get("origin")
        if origin is not None and origin != self._access.origin:
            return JSONResponse({"detail": "wrong origin"}, 403)
        given = headers.get("authorization", "").removeprefix("Bearer ")
        if not secrets.compare_digest(given.encode(), self._access.token.encode()):
            return JSONResponse({"detail": "wrong or missing token"}, 401)
        return _body_refusal(scope, headers)

    def _with_headers(self, scope: Scope, send: Send) -> Send:
        viewer = scope.get("path", "").startswith("/viewer")

        async def send_with_headers(message: Message) -> None:
            if message["type"] == "http.response.start":
                headers = MutableHeaders(scope=message)
                policy = self._viewer_policy if viewer else self._page_policy
                headers["content-security-policy"] = policy
                headers["x-content-type-options"] = "nosniff"
                headers["referrer-policy"] = "no-referrer"
                headers.setdefault("cache-control", "no-store")
            await send(message)

        return send_with_headers


def _body_refusal(scope: Scope, headers: Headers) -> JSONResponse | None:
    if scope["method"] != "POST":
        return None
    content_type = headers.get("content-type", "").partition(";")[0].strip().lower()
    if content_type != "application/json":
        return JSONResponse({"detail": "only application/json is read"}, 415)
    length = headers.get("content-length", "")
    if not length.isdigit() or int(length) > BODY_LIMIT:
        return JSONResponse({"detail": f"state a length of at most {BODY_LIMIT} bytes"}, 413)
    return None


def _limited(receive: Receive) -> Receive:
    # The HTTP server holds a body to its stated length; this holds for any other server too.
    received = 0

    async def receive_limited() -> Message:
        nonlocal received
        message = await receive()
        received += len(message.get("body", b""))
        if received > BODY_LIMIT:
            return {"type": "http.disconnect"}
        return message

    return receive_limited


def _page_policy(viewer_origin: str) -> str:
    return (
        "default-src 'self'; img-src 'self' blob: data:; style-src 'self'; script-src 'self';"
        f" connect-src 'self'; frame-src {viewer_origin};"
        " frame-ancestors 'none'; base-uri 'none'; form-action 'none'"
    )


def _viewer_policy(page_origin: str) -> str:
    return (
        "default-src 'self'; script-src 'self' 'wasm-unsafe-eval'; style-src 'self' 'unsafe-inline';"
        " connect-src 'self' data: blob:; worker-src blob:;"
        f" img-src 'self' data: blob:; frame-ancestors {page_origin}; base-uri 'none'"
    )
