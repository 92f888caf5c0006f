"""`reach doctor` on the simulated station and on bad input; on a YuMi: tests of the emulator."""

from __future__ import annotations

import json
import socket
import tomllib
from pathlib import Path

import pytest

from collection.cli.main import main
from collection.errors import CameraError
from collection.station.checkup import Check, Status, examine, guarded
from collection.station.station import find_station_file, load_station, parse_station


def checks(capsys: pytest.CaptureFixture[str]) -> dict[str, dict[str, str]]:
    report = json.loads(capsys.readouterr().out)
    return {check["name"]: check for check in report["checks"]}


def test_the_simulated_station_is_well(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    arguments = ["doctor", "--station", "simulated", "--out", str(tmp_path), "--capture", "--json"]
    assert main(arguments) == 0
    found = checks(capsys)
    looked_at = {"arm", "gripper", "gripper calibration", "camera", "image", "calibration"}
    assert looked_at | {"pose error", "ports", "disk"} == set(found)
    assert "fail" not in {check["status"] for check in found.values()}
    assert "trials" in found["disk"]["detail"]


def test_the_table_has_one_line_a_check(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["doctor"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert len(lines) == 8
    assert all(line.split()[0] in {"OK", "WARN"} for line in lines)


def test_a_page_that_cannot_be_reached_is_a_failed_check(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    def refused(*_: object) -> socket.socket:
        raise ConnectionRefusedError(111, "Connection refused")

    monkeypatch.setattr(socket, "create_connection", refused)
    assert main(["doctor", "--json"]) == 1
    assert checks(capsys)["ports"]["status"] == "fail"


@pytest.mark.parametrize("station", ["simulated", "yumi"])
def test_the_example_is_a_commented_station_file(
    station: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["doctor", "--example", "--station", station]) == 0
    text = capsys.readouterr().out
    assert text.count("#") > 10
    tomllib.loads(text)
    assert parse_station(text, "example.toml").name == station


def test_the_example_is_a_station_that_works(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["doctor", "--example"]) == 0
    path = tmp_path / "station.toml"
    path.write_text(capsys.readouterr().out)
    assert main(["doctor", "--station", str(path), "--out", str(tmp_path), "--json"]) == 0


def real_station(folder: Path, calibration: str) -> Path:
    """A real station whose controller nobody answers for, and whose camera is a folder."""
    text = find_station_file("yumi").read_text()
    for old, new in (("192.168.125.1", "127.0.0.1:9"), ("calibration.json", calibration)):
        assert f'"{old}"' in text
        text = text.replace(f'"{old}"', f'"{new}"')
    path = folder / "station.toml"
    path.write_text(text)
    return path


def test_a_missing_folder_and_calibration_fail_and_the_rest_is_still_checked(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = real_station(tmp_path, "calibration.json")
    assert main(["doctor", "--station", str(path), "--out", str(tmp_path), "--json"]) == 1
    found = checks(capsys)
    assert found["arm"]["status"] == found["gripper"]["status"] == "fail"
    assert found["camera"]["status"] == "fail" and "frames" in found["camera"]["detail"]
    assert found["calibration"]["status"] == "fail"
    assert "reach calibrate" in found["calibration"]["detail"]
    assert found["disk"]["status"] == "ok"


def test_frames_that_bring_their_pose_need_no_calibration_file(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = real_station(tmp_path, "")
    (tmp_path / "frames").mkdir()
    assert main(["doctor", "--station", str(path), "--out", str(tmp_path), "--json"]) == 1
    found = checks(capsys)
    assert found["calibration"]["status"] == "warn"
    assert "T_world_camera" in found["calibration"]["detail"]
    assert found["camera"]["status"] == "ok"


@pytest.mark.parametrize(
    ("change", "complaint"),
    [
        (('driver = "simulated"', 'driver = "panda"'), "yumi"),
        (('side = "right"', "colour = 1"), "colour"),
        (('side = "right"', 'side = "middle"'), "side"),
    ],
)
def test_a_wrong_station_file_is_one_line_and_exit_code_2(
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    change: tuple[str, str],
    complaint: str,
) -> None:
    main(["doctor", "--example"])
    path = tmp_path / "station.toml"
    path.write_text(capsys.readouterr().out.replace(*change, 1))
    assert main(["doctor", "--station", str(path)]) == 2
    error = capsys.readouterr().err
    assert error.count("\n") == 1 and complaint in error and "station.toml:" in error


def test_an_error_becomes_a_failed_check() -> None:
    def look():  # type: ignore[no-untyped-def]
        yield Check("first", Status.OK, "")
        raise CameraError("lens cap")

    first, second = guarded("camera", look)
    assert first.status is Status.OK
    assert second == Check("camera", Status.FAIL, "lens cap")


def test_examining_leaves_the_devices_disconnected(tmp_path: Path) -> None:
    station = load_station("simulated")
    list(examine(station, tmp_path / "not" / "there" / "yet"))
    assert not station.arm.state().connected
    assert not station.gripper.state().connected
