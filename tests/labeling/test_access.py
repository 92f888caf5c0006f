"""Who is kept out: wrong hosts, origins, tokens, types, sizes, paths, and unsafe addresses."""

from __future__ import annotations

import ssl
from pathlib import Path
from typing import Any

import httpx
import pytest

from labeling.control.commands import Actor
from labeling.display.console import Console
from labeling.display.pictures import PictureShelf
from labeling.errors import OutsideSessionError, UnsafeAddressError
from labeling.server.access import make_access
from labeling.server.recordings import TICKET_SECONDS, RecordingTickets
from labeling.server.server import ConsoleServer, free_port
from logs.journal.events import Source

PNG = b"\x89PNG\r\n\x1a\n"
ADDRESSES = [
    ("GET", "/api/view"),
    ("GET", "/api/stream"),
    ("GET", "/api/terms"),
    ("GET", "/api/review"),
    ("GET", "/api/pictures/a/1/b"),
    ("POST", "/api/commands"),
    ("POST", "/api/alive"),
    ("POST", "/api/recordings"),
]


@pytest.fixture
def server(bench: Any, serve: Any) -> ConsoleServer:
    started: ConsoleServer = serve(bench)
    return started


@pytest.fixture
def client(server: ConsoleServer, client_of: Any) -> httpx.Client:
    made: httpx.Client = client_of(server)
    return made


@pytest.mark.parametrize("token", [None, "", "Bearer", "Bearer wrong", "Bearer " + "t" * 23])
def test_no_token_no_answer(client: httpx.Client, token: str | None) -> None:
    del client.headers["authorization"]
    headers = {} if token is None else {"authorization": token}
    for method, path in ADDRESSES:
        answer = client.request(method, path, headers=headers, json={})
        assert answer.status_code == 401, path


def test_a_token_in_the_address_is_no_token(client: httpx.Client) -> None:
    token = client.headers.pop("authorization").removeprefix("Bearer ")
    assert client.get(f"/api/view?token={token}").status_code == 401


@pytest.mark.parametrize("origin", ["http://evil.example", "null", "http://localhost:1"])
def test_another_site_is_refused_also_on_the_stream(client: httpx.Client, origin: str) -> None:
    for method, path in ADDRESSES:
        answer = client.request(method, path, headers={"origin": origin}, json={})
        assert answer.status_code == 403, path


def test_the_embedded_view_s_site_may_not_use_the_api(
    client: httpx.Client, server: ConsoleServer
) -> None:
    headers = {"origin": server.access.viewer_origin}
    assert client.get("/api/view", headers=headers).status_code == 403


@pytest.mark.parametrize("host", ["evil.example", "127.0.0.1", "127.0.0.1:1", ""])
def test_another_host_name_is_refused(client: httpx.Client, host: str) -> None:
    for path in ("/", "/api/view", "/api/stream", "/viewer/"):
        assert client.get(path, headers={"host": host}).status_code == 400, path


@pytest.mark.parametrize(
    "content_type", ["text/plain", "application/x-www-form-urlencoded", "multipart/form-data", ""]
)
def test_only_json_is_read(bench: Any, client: httpx.Client, content_type: str) -> None:
    body = bench.command("stop").model_dump_json()
    headers = {"content-type": content_type}
    assert client.post("/api/commands", content=body, headers=headers).status_code == 415
    assert not bench.state.stopped


def test_a_huge_body_is_refused(client: httpx.Client) -> None:
    headers = {"content-type": "application/json"}
    body = b'{"kind": "note", "value": {"text": "' + b"x" * 20_000 + b'"}}'
    assert client.post("/api/commands", content=body, headers=headers).status_code == 413
    chunks = iter([body])  # sent without a stated length
    assert client.post("/api/commands", content=chunks, headers=headers).status_code == 413


def test_no_other_file_is_served(client: httpx.Client) -> None:
    for path in (
        "/../../etc/passwd",
        "/..%2f..%2fetc/passwd",
        "/%2e%2e/%2e%2e/etc/passwd",
        "/viewer/..%2f..%2fsession.json",
        "/viewer/../api.py",
        "/viewer/api.py",
        "/session.json",
        "/events.jsonl",
        "/console.css/../api.py",
        "/viewer/recording/..%2f..%2fevents.jsonl.rrd",
        "/docs",
        "/openapi.json",
    ):
        answer = client.get(path)
        assert answer.status_code == 404, path
        assert b"root:" not in answer.content and b"session_id" not in answer.content


@pytest.mark.parametrize("name", ["../../session.json", "..%2f..%2fsession.json", "/etc/passwd"])
def test_no_path_is_a_picture(client: httpx.Client, bench: Any, name: str) -> None:
    assert client.get(f"/api/pictures/{bench.trial(1).trial_id}/1/{name}").status_code == 404


def test_a_picture_outside_the_session_is_never_read(tmp_path: Path) -> None:
    inside, outside = tmp_path / "session", tmp_path / "secret.png"
    inside.mkdir()
    outside.write_bytes(PNG)
    (inside / "link.png").symlink_to(outside)
    (inside / "text.png").write_text("no picture")
    shelf = PictureShelf(inside)
    for path in (outside, inside / "link.png", inside / ".." / "secret.png", inside / "text.png"):
        shelf.put("t", 1, "p", path)
        with pytest.raises(OutsideSessionError):
            shelf.draw("t", 1, "p")
    (inside / "good.png").write_bytes(PNG)
    shelf.put("t", 1, "p", inside / "good.png")
    assert shelf.draw("t", 1, "p") == PNG


def test_a_recording_needs_a_ticket_that_expires(tmp_path: Path) -> None:
    now = [0.0]
    root = tmp_path / "session"
    root.mkdir()
    recording = root / "trial.rrd"
    recording.touch()
    tickets = RecordingTickets(root, clock=lambda: now[0])
    ticket = tickets.issue(recording)
    assert tickets.redeem(ticket) == recording
    assert tickets.redeem(ticket[:-1]) is None
    now[0] = TICKET_SECONDS
    assert tickets.redeem(ticket) is None
    (tmp_path / "other.rrd").touch()
    (root / "link.rrd").symlink_to(tmp_path / "other.rrd")
    for path in (tmp_path / "other.rrd", root / "link.rrd", root / "session.json"):
        with pytest.raises(OutsideSessionError):
            tickets.issue(path)


def test_a_recording_is_served_to_the_view_by_ticket(
    bench: Any, serve: Any, client_of: Any
) -> None:
    recording = bench.folder.path / "trial.rrd"
    recording.write_bytes(b"RRF2")
    server = serve(bench, mode="review", recordings=lambda trial: recording)
    client = client_of(server)
    path = client.post("/api/recordings", json={"trial_id": bench.trial(1).trial_id}).json()["path"]
    del client.headers["authorization"]
    assert client.get(path).content == b"RRF2"
    assert client.get("/viewer/recording/guess.rrd").status_code == 404


def test_the_pages_forbid_what_they_do_not_need(client: httpx.Client) -> None:
    page = client.get("/").headers
    assert "default-src 'self'" in page["content-security-policy"]
    assert "unsafe" not in page["content-security-policy"]
    assert "frame-ancestors 'none'" in page["content-security-policy"]
    assert page["x-content-type-options"] == "nosniff"
    viewer = client.get("/viewer/").headers["content-security-policy"]
    assert f"frame-ancestors http://127.0.0.1:{client.base_url.port}" in viewer


def test_the_link_keeps_its_token_in_the_fragment() -> None:
    access = make_access("127.0.0.1", 8000)
    assert access.link == f"http://127.0.0.1:8000/#token={access.token}"
    assert access.token != make_access("127.0.0.1", 8000).token


@pytest.mark.parametrize("host", ["0.0.0.0", "::", "192.168.1.5", "lab.example"])
def test_another_address_needs_a_token_and_tls(
    host: str, make_certificate: Any, tmp_path: Path
) -> None:
    certificate, key = make_certificate(tmp_path)
    pair = {"certificate": certificate, "key": key}
    for given in ({}, {"token": "x" * 20}, pair):
        with pytest.raises(UnsafeAddressError, match="ssh -L"):
            make_access(host, 8000, **given)  # type: ignore[arg-type]
    assert make_access(host, 8000, token="x" * 20, **pair).scheme == "https"


@pytest.mark.parametrize("host", ["127.0.0.1", "::1", "localhost", "127.8.0.1"])
def test_this_machine_needs_nothing_more(host: str) -> None:
    assert make_access(host, 8000).scheme == "http"


def test_a_short_token_and_half_a_certificate_are_refused(tmp_path: Path) -> None:
    with pytest.raises(UnsafeAddressError, match="guessed"):
        make_access("127.0.0.1", 8000, token="1234")
    with pytest.raises(UnsafeAddressError, match="both"):
        make_access("127.0.0.1", 8000, certificate=tmp_path / "c.pem")


def test_files_that_make_no_tls_are_refused_before_anything_begins(
    make_certificate: Any, tmp_path: Path
) -> None:
    certificate, key = make_certificate(tmp_path)
    with pytest.raises(UnsafeAddressError, match=r"nowhere\.pem is no file"):
        make_access("127.0.0.1", 8000, certificate=certificate, key=tmp_path / "nowhere.pem")
    with pytest.raises(UnsafeAddressError, match="no certificate and its unencrypted key"):
        make_access("127.0.0.1", 8000, certificate=key, key=certificate)


def test_tls_is_spoken_with_a_certificate(
    bench: Any, make_certificate: Any, tmp_path: Path
) -> None:
    certificate, key = make_certificate(tmp_path)
    access = make_access("127.0.0.1", free_port(), token="x" * 20, certificate=certificate, key=key)
    console = Console(bench.controller, Actor("ann", Source.OPERATOR), "monday")
    with ConsoleServer(console, access):
        trusted = ssl.create_default_context(cafile=str(certificate))
        headers = {"authorization": "Bearer " + "x" * 20}
        answer = httpx.get(f"{access.origin}/api/view", headers=headers, verify=trusted)
        assert answer.json()["title"] == "monday"
