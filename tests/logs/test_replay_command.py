"""`reach replay`: views are rebuilt, copied, refused, or served to a browser elsewhere."""

import http.client
import signal
import socket
import subprocess
import sys
from pathlib import Path

import pytest

from collection.cli.replay import replay
from logs.errors import ViewError
from logs.session.folder import SessionFolder
from logs.view.viewer import LOOPBACK, WebAddress, WebViewer, show_recordings


@pytest.fixture(scope="module")
def session(sessions, tmp_path_factory) -> SessionFolder:
    return sessions.build_session(tmp_path_factory.mktemp("s") / "session", 5, samples=3)


def test_replay_rebuilds_all_views(session: SessionFolder, tmp_path: Path, capsys) -> None:
    for path in session.path.rglob("*.rrd"):
        path.unlink()
    replay(session.path, save=tmp_path / "out.rrd", no_viewer=True)
    assert capsys.readouterr().out.strip() == str(tmp_path / "out.rrd")
    assert (tmp_path / "out.rrd").stat().st_size > 10_000
    assert len(list(session.path.glob("trials/*/trial.rrd"))) == 5
    replay(session.path, trial="3", blind=True, no_viewer=True)
    shown = Path(capsys.readouterr().out.strip())
    assert shown.name == "trial.blind.rrd" and shown.parent.name.startswith("0003_")


@pytest.mark.parametrize(
    ("options", "problem"),
    [
        ({"blind": True}, "--trial"),
        ({"trial": "1", "save": Path("out.mp4")}, r"ends in \.rrd"),
        ({"trial": "1", "model": "reach"}, "--model"),
        ({"model": "nobody"}, "valid: point, reach"),
        ({"web": True, "no_viewer": True}, "choose one"),
    ],
)
def test_replay_refuses_what_makes_no_sense(
    session: SessionFolder, options: dict, problem: str
) -> None:
    with pytest.raises(ViewError, match=problem) as raised:
        replay(session.path, **{"no_viewer": True, **options})
    assert "\n" not in str(raised.value)


def test_without_a_screen_the_browser_is_named() -> None:
    if sys.platform != "linux":
        pytest.skip("other systems always have a screen")
    with pytest.raises(ViewError, match="no screen .* --web"):
        show_recordings([Path("any.rrd")], environment={})


def test_the_tunnel_names_the_way_this_machine_was_reached() -> None:
    address = WebAddress(9090, 9876)
    line = address.tunnel({"SSH_CONNECTION": "10.0.0.5 51234 192.168.7.2 2222"})
    ports = f"-L 9090:{LOOPBACK}:9090 -L 9876:{LOOPBACK}:9876"
    assert line.startswith(f"ssh -N {ports} -p 2222 ") and line.endswith("@192.168.7.2")
    assert address.tunnel({}).endswith(f"@{socket.gethostname()}")
    assert address.link.endswith("/?url=rerun%2Bhttp%3A%2F%2F127.0.0.1%3A9876%2Fproxy")


def get(port: int, path: str) -> tuple[int, bytes]:
    connection = http.client.HTTPConnection(LOOPBACK, port, timeout=20)
    try:
        connection.request("GET", path)
        answer = connection.getresponse()
        return answer.status, answer.read()
    finally:
        connection.close()


@pytest.mark.viewer
@pytest.mark.timeout(120)
def test_a_browser_gets_page_program_and_recording(session: SessionFolder) -> None:
    """From this machine alone: every file that the page needs comes from the same server."""
    from logs.view.trial import fresh_view

    take = session.trial_folder(session.descriptor.trials[0].trial_id)
    with WebViewer([fresh_view(take)]) as viewer:
        page, data = viewer.address.page, viewer.address.data
        status, html = get(page, "/")
        assert status == 200 and b"re_viewer" in html
        for name, size in (("/re_viewer.js", 10_000), ("/re_viewer_bg.wasm", 5_000_000)):
            status, content = get(page, name)
            assert status == 200 and len(content) > size, name
        for port in (page, data):
            with pytest.raises(OSError):  # bound to the loopback alone
                socket.create_connection((_own_address(), port), timeout=2).close()
    for port in (page, data):
        with pytest.raises(OSError):
            socket.create_connection((LOOPBACK, port), timeout=2).close()


def _own_address() -> str:
    """Another address of this machine's; one in the loopback's range that is not 127.0.0.1."""
    return "127.0.0.2"


@pytest.mark.viewer
@pytest.mark.timeout(120)
def test_a_taken_port_is_left_alone(session: SessionFolder, monkeypatch) -> None:
    from logs.view.trial import fresh_view

    take = session.trial_folder(session.descriptor.trials[0].trial_id)
    with socket.create_server((LOOPBACK, 0)) as taken:
        port = taken.getsockname()[1]
        monkeypatch.setattr("logs.view.viewer.WEB_PORT", port)
        with WebViewer([fresh_view(take)]) as viewer:
            assert viewer.address.page != port
            assert get(viewer.address.page, "/")[0] == 200


def test_a_server_that_cannot_start_is_one_clear_error(monkeypatch) -> None:
    monkeypatch.setenv("RERUN_CLI_PATH", "/bin/false")
    with pytest.raises(ViewError, match="does not start: it ended, code 1"):
        WebViewer([Path("any.rrd")])
    monkeypatch.setenv("RERUN_CLI_PATH", "/nowhere/rerun")
    with pytest.raises(ViewError, match="does not start: .*nowhere"):
        WebViewer([Path("any.rrd")])


@pytest.mark.viewer
@pytest.mark.slow
@pytest.mark.timeout(120)
@pytest.mark.parametrize("ending", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
def test_the_command_says_where_to_look_and_ends_its_server(
    session: SessionFolder, ending: signal.Signals
) -> None:
    program = "from collection.cli.main import run; run()"
    arguments = f"replay {session.path} --trial 2 --web".split()
    command = [sys.executable, "-c", program, *arguments]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
        try:
            assert process.stdout is not None
            lines = [process.stdout.readline() for _ in range(3)]
            port = int(lines[0].split("127.0.0.1:")[1].split("/")[0])
            assert lines[1].split(": ")[1].startswith(f"ssh -N -L {port}:")
            assert get(port, "/")[0] == 200
            process.send_signal(ending)
            assert process.wait(60) == 0
        finally:
            process.kill()
    with pytest.raises(OSError):
        socket.create_connection((LOOPBACK, port), timeout=2).close()
