"""The embedded viewer's files: taken once, and nothing is left running."""

import socket
from pathlib import Path

import pytest

from labeling.server import viewer_assets
from labeling.server.viewer_assets import ASSETS, ViewerAssetsError, viewer_asset


@pytest.fixture
def ports(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> list[int]:
    """The ports of every server that is started, with an empty cache."""
    used: list[int] = []
    free = viewer_assets._free_ports

    def noted(count: int) -> list[int]:
        used.extend(free(count))
        return used[-count:]

    monkeypatch.setattr(viewer_assets, "_free_ports", noted)
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
