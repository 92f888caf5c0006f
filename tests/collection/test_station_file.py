"""The station file: what is wrong is told with its line and the valid keys."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
import trimesh

from collection.clock import SimulatedClock, WallClock
from collection.errors import CameraTimeoutError, StationFileError
from collection.station.station import (
    PACKAGED,
    build_station,
    find_station_file,
    load_station,
    parse_station,
    read_station,
    station_names,
)
from reach.errors import ReachError, UnknownNameError
from reach.objects import GraspObject
from reach.stable_poses import StablePose
from reach.transforms import make_transform

SIMULATED = (PACKAGED / "simulated.toml").read_text()


def line_of(text: str, part: str) -> int:
    return 1 + next(n for n, line in enumerate(text.splitlines()) if part in line)


def test_the_example_is_a_valid_station() -> None:
    config = parse_station(SIMULATED, "example.toml")
    assert config.name == "simulated"
    assert config.motion.closing_force == 20.0
    assert "simulated" in station_names()


def test_a_path_and_a_name_give_the_same_station(tmp_path: Path) -> None:
    path = tmp_path / "mine.toml"
    path.write_text(SIMULATED)
    assert read_station(path) == read_station("simulated")
    assert load_station(path).text == SIMULATED


def test_an_unknown_station_lists_the_packaged_ones() -> None:
    with pytest.raises(UnknownNameError, match="simulated"):
        load_station("nowhere")


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("lift_height = 0.100", "lift_hight = 0.1", r"unknown key 'motion.lift_hight'; valid.*lift_height"),
        ("hold_time = 1.0", 'hold_time = "long"', r"motion.hold_time: .*number.*'long'"),
        ("hold_time = 1.0", "hold_time = 0.5", r"greater than or equal to 1"),
        ('driver = "simulated"      # or "yumi"', 'driver = "kuka" #', r"robot driver 'kuka'; valid: simulated, yumi"),
        ('sensor = "structured-light"', 'sensor = "sonar"', r"structured-light.*stereo"),
        ("friction = [0.3", "friction = [0.9", r"not a range"),
        ('side = "right"', 'sied = "right"', r"unknown key 'robot.sied'; valid keys: base, driver, side"),
    ],
)  # fmt: skip
def test_a_mistake_is_told_with_its_line(old: str, new: str, message: str) -> None:
    assert old in SIMULATED
    text = SIMULATED.replace(old, new, 1)
    with pytest.raises(StationFileError, match=message) as raised:
        parse_station(text, "lab.toml")
    assert str(raised.value).startswith(f"lab.toml:{line_of(text, new)}: ")
    assert "\n" not in str(raised.value)
    assert isinstance(raised.value, ReachError)


def test_an_unknown_section_is_told_with_the_valid_ones() -> None:
    text = SIMULATED + "\n[lights]\non = true\n"
    with pytest.raises(StationFileError, match="unknown key 'lights'; valid.*workspace") as raised:
        parse_station(text, "lab.toml")
    assert f":{line_of(text, '[lights]')}:" in str(raised.value)


def test_a_missing_driver_lists_the_valid_ones() -> None:
    text = SIMULATED.replace('driver = "simulated" ', "# ", 1)
    with pytest.raises(StationFileError, match=r"\[robot\] needs a driver; valid: simulated, yumi"):
        parse_station(text, "lab.toml")


def test_a_file_that_is_no_text_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "lab.toml"
    path.write_bytes(b"\xff\xfe\x00")
    with pytest.raises(StationFileError, match=r"lab.toml: not a text file in UTF-8"):
        load_station(path)


def test_broken_toml_is_told_with_its_line() -> None:
    with pytest.raises(StationFileError, match=r"lab.toml: not a TOML file: .*line 2"):
        parse_station('name = "x"\n[motion\n', "lab.toml")


def test_a_scripted_fault_of_unknown_kind_is_refused() -> None:
    text = SIMULATED + '\n[[simulation.faults]]\nkind = "slip"\nattempt = 1\n'
    assert parse_station(text, "lab.toml").simulation.faults[0].attempt == 1  # type: ignore[union-attr]
    wrong = text + '\n[[simulation.faults]]\nkind = "fire"\nattempt = 2\n'
    with pytest.raises(StationFileError, match="emergency_stop") as raised:
        parse_station(wrong, "lab.toml")
    assert f":{line_of(wrong, 'fire')}:" in str(raised.value)


def test_faults_of_the_station_file_happen_on_schedule() -> None:
    text = SIMULATED + '\n[[simulation.faults]]\nkind = "camera_timeout"\nattempt = 2\n'
    station = build_station(parse_station(text, "lab.toml"), text, PACKAGED, 0)
    assert station.simulation is not None
    mesh = trimesh.creation.box((0.03, 0.03, 0.03))
    obj = GraspObject("cube", mesh.vertices, mesh.faces, 0.01)
    resting = StablePose(0, 1.0, make_transform(None, (0, 0, 0.015)))
    with station.camera as camera:
        for attempt in (1, 2, 3):
            station.simulation.place(obj, resting, np.random.default_rng(attempt))
            if attempt == 2:
                with pytest.raises(CameraTimeoutError):
                    camera.capture()
            camera.capture()


def test_a_simulated_device_needs_the_simulation_section() -> None:
    text = SIMULATED.split("# Drawn in secret")[0]
    with pytest.raises(StationFileError, match=r"\[simulation\]"):
        parse_station(text, "lab.toml")


@pytest.mark.parametrize(
    ("old", "new", "named"),
    [
        ('driver = "simulated"', 'driver = "yumi"', r"lab\.toml:\d+: robot 'yumi' with camera"),
        (
            "closing_force = 20.0",
            "closing_force = 25.0",
            r"lab\.toml:\d+: closing_force 25 N .* 20 N",
        ),
        ('geometry = "yumi"', 'geometry = "schunk"', r"lab\.toml:\d+: .*schunk.*yumi"),
    ],
)
def test_what_fits_no_station_is_refused_with_its_line(old: str, new: str, named: str) -> None:
    assert old in SIMULATED
    text = SIMULATED.replace(old, new, 1)
    if "yumi" in new:  # the keys of the simulated robot mean nothing to a real one
        text = re.sub(r"(driver = \"yumi\").*?(\n\[camera\])", r"\1\n\2", text, flags=re.DOTALL)
    with pytest.raises(StationFileError, match=named):
        parse_station(text, "lab.toml")


def test_a_real_station_follows_the_wall_clock_and_has_no_simulation_section() -> None:
    text = find_station_file("yumi").read_text()
    assert isinstance(
        build_station(parse_station(text, "lab.toml"), text, PACKAGED, 0).clock, WallClock
    )
    with pytest.raises(StationFileError, match=r"lab\.toml:\d+: \[simulation\].*real robot"):
        parse_station(f"{text}\n[simulation]\nlatency = 0.02\n", "lab.toml")


def test_hidden_draws_stay_in_their_ranges_and_belong_to_the_object() -> None:
    station = load_station("simulated", seed=3)
    assert station.simulation is not None and isinstance(station.clock, SimulatedClock)
    settings = station.simulation.settings
    objects = []
    for size in np.linspace(0.02, 0.04, 12):
        mesh = trimesh.creation.box((size, size, size))
        objects.append(GraspObject("cube", mesh.vertices, mesh.faces, 0.01))
    draws = [station.simulation.hidden(obj).world for obj in objects]
    assert len({each.friction for each in draws}) == len(draws)
    for each in draws:
        assert settings.friction[0] <= each.friction <= settings.friction[1]
        assert settings.pad_modulus[0] <= each.pad_modulus <= settings.pad_modulus[1]
    again = load_station("simulated", seed=3).simulation
    assert again is not None and again.hidden(objects[5]).world == draws[5]


def test_an_operator_places_where_the_grasp_is_in_reach() -> None:
    station = load_station("simulated", seed=3)
    simulation = station.simulation
    assert simulation is not None
    mesh = trimesh.creation.box((0.03, 0.03, 0.03))
    obj = GraspObject("cube", mesh.vertices, mesh.faces, 0.01)
    resting = StablePose(0, 1.0, make_transform(None, (0, 0, 0.015)))
    center = station.config.workspace.center
    for seed in range(5):
        simulation.place(
            obj, resting, np.random.default_rng(seed), accept=lambda T: T[0, 3] > center[0]
        )
        x, y, z = simulation.true_T_world_object()[:3, 3]
        assert center[0] <= x + 1e-3 and abs(y - center[1]) < 0.045
        assert z == pytest.approx(0.015, abs=1e-3)
    assert simulation.attempt == 5
