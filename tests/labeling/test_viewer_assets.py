"""The embedded viewer's files: taken once, and nothing is left running."""

import socket
from pathlib import Path

import pytest

from labeling.server.viewer_assets import ASSETS, ViewerAssetsError, viewer_asset
from logs.view import viewer


@pytest.fixture
def ports(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> list[int]:
    """The ports of every server that is started, with an empty cache."""
    used: list[int] = []
    free = viewer._free_port

    def noted(wanted: int) -> int:
        used.append(free(wanted))
        return used[-1]

    monkeypatch.setattr(viewer, "_free_port", noted)
    monkeypatch.setenv("REACH_CACHE", str(tmp_path))
    return used


def test_both_files_are_fetched_once_and_the_server_is_gone(ports: list[int]) -> None:
    for name in ASSETS:
        assert viewer_asset(name).stat().st_size > 10_000
    assert len(ports) == 2  # one server
    for port in ports:
        with pytest.raises(OSError):
            socket.create_connection(("127.0.0.1", port), timeout=2).close()


def test_a_viewer_that_is_missing_is_told(
    ports: list[int], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("importlib.util.find_spec", lambda _: None)
    with pytest.raises(ViewerAssetsError, match="not installed"):
        viewer_asset("re_viewer.js")
