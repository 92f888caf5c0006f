"""Robot Web Services 1.0 over HTTP on the loopback address: digest authentication, JSON."""

from __future__ import annotations

import hashlib
import json
import re
import secrets
import threading
from collections.abc import Callable
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from typing import Any
from urllib.parse import parse_qs, unquote, urlsplit

from yumi_emulator.controller import Controller
from yumi_emulator.resources import HttpError, Resources

USER, PASSWORD, REALM = "Default User", "robotics", "validusers@robapi.abb"
MAX_SESSIONS = 70


class WebServices:
    """Serves a controller; a context manager.

    Args:
        controller: what it serves.
        password: of the user `Default User`.
    """

    def __init__(self, controller: Controller, password: str = PASSWORD) -> None:
        self.controller, self.password = controller, password
        self.resources = Resources(controller)
        self.sessions: set[str] = set()
        self.requests = 0
        self._nonce = secrets.token_hex(16)
        self._countdown, self._act = 0, None

        class Handler(_Handler):
            services = self

        self._server = ThreadingHTTPServer(("127.0.0.1", 0), Handler)
        self._server.daemon_threads = True
        self._thread = threading.Thread(
            target=self._server.serve_forever, kwargs={"poll_interval": 0.005}, daemon=True
        )

    @property
    def address(self) -> str:
        """`host:port` of the emulated controller."""
        return "{}:{}".format(*self._server.server_address[:2])

    @property
    def url(self) -> str:
        return f"http://{self.address}"

    def __enter__(self) -> WebServices:
        self._thread.start()
        return self

    def __exit__(self, *exception: object) -> None:
        self._server.shutdown()
        self._server.server_close()
        self._thread.join()

    def after_exchanges(self, count: int, act: Callable[[], None]) -> None:
        """Do something once so many more exchanges with the program have been served."""
        self._countdown, self._act = count, act
        self.count_exchange()

    def count_exchange(self) -> None:
        if self._act is not None and self._countdown == 0:
            self._act, act = None, self._act
            act()
        self._countdown -= 1

    def challenge(self) -> str:
        """The WWW-Authenticate header (RFC 7616, MD5, qop=auth)."""
        return f'Digest realm="{REALM}", qop="auth", nonce="{self._nonce}", algorithm="MD5"'

    def authorized(self, method: str, header: str) -> bool:
        given = dict(re.findall(r'(\w+)="?([^",]+)"?', header))
        if given.get("username") != USER or given.get("nonce") != self._nonce:
            return False
        inner = _md5(f"{USER}:{REALM}:{self.password}")
        outer = _md5(f"{method}:{given['uri']}")
        fields = (inner, self._nonce, given["nc"], given["cnonce"], given["qop"], outer)
        return secrets.compare_digest(_md5(":".join(fields)), given["response"])


class _Handler(BaseHTTPRequestHandler):
    """One connection; each connection has its thread."""

    protocol_version = "HTTP/1.1"
    wbufsize = -1  # head and body in one packet: two would wait 40 ms for an acknowledgment
    services: WebServices

    def do_GET(self) -> None:
        self._serve("GET")

    def do_POST(self) -> None:
        self._serve("POST")

    def log_message(self, *arguments: object) -> None:
        """Say nothing: tests print what they need."""

    def _serve(self, method: str) -> None:
        body = self.rfile.read(int(self.headers.get("Content-Length") or 0)).decode()
        services, controller = self.services, self.services.controller
        with controller.lock:
            services.requests += 1
            if _use_up(controller, "deaf"):
                return self._hang_up()
            header = self.headers.get("Authorization", "")
            if not services.authorized(method, header):
                return self._answer(401, None, {"WWW-Authenticate": services.challenge()})
            session = self._session()
            if session is None:
                return self._answer(503, None)
            self._carry_out(method, body, session)
        return None

    def _carry_out(self, method: str, body: str, session: str) -> None:
        url = urlsplit(self.path)
        path = unquote(url.path).strip("/")
        query = {key: values[-1] for key, values in parse_qs(url.query).items()}
        form = {key: values[-1] for key, values in parse_qs(body).items()}
        controller = self.services.controller
        to_program = "symbol/data" in path
        if to_program and _use_up(controller, "drop_before"):
            return self._hang_up()
        cookies = {"Set-Cookie": f"-http-session-={session}; path=/"}
        if path == "logout":
            self.services.sessions.discard(session)
            return self._answer(200, {}, cookies)
        try:
            states = self.services.resources.serve(method, path, query, form)
        except HttpError as error:
            status = {"code": error.code, "msg": error.message}
            return self._answer(error.status, {"_embedded": {"status": status}}, cookies)
        if to_program:
            if _use_up(controller, "drop_after"):
                return self._hang_up()
            self.services.count_exchange()
        if states is None:
            return self._answer(204, None, cookies)
        return self._answer(200, {"_links": {}, "_embedded": {"_state": states}}, cookies)

    def _session(self) -> str | None:
        found = re.search(r"-http-session-=(\w+)", self.headers.get("Cookie", ""))
        sessions = self.services.sessions
        if found and found.group(1) in sessions:
            return found.group(1)
        if len(sessions) >= MAX_SESSIONS:
            return None
        sessions.add(session := secrets.token_hex(8))
        return session

    def _hang_up(self) -> None:
        self.close_connection = True

    def _answer(self, status: int, content: Any, headers: dict[str, str] | None = None) -> None:
        text = b"" if content is None else json.dumps(content).encode()
        self.send_response(status)
        for name, value in (headers or {}).items():
            self.send_header(name, value)
        if status != 204:
            kind = "text/html" if content is None else "application/json"
            self.send_header("Content-Type", kind)
            self.send_header("Content-Length", str(len(text)))
        self.end_headers()
        self.wfile.write(text)


def _use_up(controller: Controller, fault: str) -> bool:
    left = getattr(controller.faults, fault)
    setattr(controller.faults, fault, max(0, left - 1))
    return bool(left > 0)


def _md5(text: str) -> str:
    return hashlib.md5(text.encode(), usedforsecurity=False).hexdigest()
