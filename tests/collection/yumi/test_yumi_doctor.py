"""`reach doctor` and the guided pose on the emulated controller, over the station file."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from yumi_emulator import Controller, WebServices

from collection.calibration.procedure import ObservedArm
from collection.clock import SimulatedClock
from collection.robots.yumi import YumiConfig, build
from collection.station.checkup import Check, Status, examine
from collection.station.drivers import BuildContext
from collection.station.station import (
    Station,
    StationConfig,
    build_station,
    parse_station,
    read_station,
)


@pytest.fixture
def whole_station(services: WebServices, clock: SimulatedClock, tmp_path: Path) -> Station:
    """The packaged real station, its address the emulator's, its clock the test's."""
    from collection.station.station import find_station_file

    (tmp_path / "frames").mkdir()
    text = find_station_file("yumi").read_text().replace("192.168.125.1", services.address)
    config = parse_station(text, "yumi.toml")
    station = build_station(config, text, tmp_path, seed=0)
    arm, gripper = build(config.robot, BuildContext(config, clock, 0, tmp_path))  # type: ignore[arg-type]
    station.arm, station.gripper, station.clock = arm, gripper, clock
    return station


def found(station: Station, folder: Path) -> dict[str, Check]:
    return {check.name: check for check in examine(station, folder)}


def test_a_controller_in_order(whole_station: Station, tmp_path: Path) -> None:
    checks = found(whole_station, tmp_path)
    for name in ("controller", "mode", "motors", "program", "module", "tool", "kinematics"):
        assert checks[name].status is Status.OK, checks[name]
    assert checks["mode"].detail == "AUTO" and checks["motors"].detail == "motoron"
    assert "mass 0.230 kg" in checks["tool"].detail
    assert checks["gripper calibration"].status is Status.WARN
    assert checks["calibration"].status is Status.FAIL  # nobody has calibrated yet
    assert not whole_station.arm.state().error


def _manual(controller: Controller) -> None:
    controller.mode = "MANR"


def _motors(controller: Controller) -> None:
    controller.state = "motoroff"


def _version(controller: Controller) -> None:
    controller.write("T_ROB_R", "reach_version", '"0"')


def _tool(controller: Controller) -> None:
    text = controller.read("T_ROB_R", "reach_tool").replace("[0,0,0]", "[0,0,136]", 1)
    controller.write("T_ROB_R", "reach_tool", text)


def _joint_7(controller: Controller) -> None:
    arm = controller.arms["T_ROB_R"]
    controller.faults.freeze_joint_7 = True
    arm.reported_joints()
    arm.motion.joints[6] += 0.3
    arm.remember()


@pytest.mark.parametrize(
    ("spoil", "name", "detail"),
    [
        (_manual, "mode", "MANR"),
        (_motors, "motors", "motoroff"),
        (_version, "module", "version 0"),
        (_tool, "tool", "must be tool0"),
        (_joint_7, "kinematics", "differ"),
    ],
)
def test_what_is_wrong_is_named(
    whole_station: Station,
    controller: Controller,
    tmp_path: Path,
    spoil: Callable[[Controller], None],
    name: str,
    detail: str,
) -> None:
    spoil(controller)
    check = found(whole_station, tmp_path)[name]
    assert check.status is Status.FAIL and detail in check.detail


def test_an_absent_controller_fails_and_the_rest_is_checked(
    whole_station: Station, controller: Controller, tmp_path: Path
) -> None:
    controller.faults.deaf = 10_000
    checks = found(whole_station, tmp_path)
    assert "does not answer" in checks["arm"].detail
    assert checks["arm"].status is Status.FAIL
    assert checks["disk"].status is Status.OK


def test_the_pose_is_read_in_manual_mode_without_a_connection(
    whole_station: Station, controller: Controller
) -> None:
    controller.mode, controller.running = "MANR", False
    arm = whole_station.arm
    assert isinstance(arm, ObservedArm)
    assert 1000 * arm.observe()[:3, 3] == pytest.approx([-9.58, -182.61, 198.63], abs=0.02)


def test_the_robot_stands_where_the_station_file_says(
    services: WebServices, clock: SimulatedClock, station: StationConfig
) -> None:
    config = YumiConfig(
        driver="yumi", address=services.address, base=(1.0, 2.0, 0.5), base_yaw=np.pi / 2
    )
    arm, _ = build(config, BuildContext(station, clock, 0, Path.cwd()))
    with arm:
        expected = [1.0 + 0.18261, 2.0 - 0.00958, 0.5 + 0.19863]
        assert arm.pose()[:3, 3] == pytest.approx(expected, abs=1e-4)
        reached = arm.link_transforms(arm.joints())["gripper"][:3, 3]
        assert reached == pytest.approx(expected, abs=0.002)


def test_the_packaged_station_is_a_valid_one() -> None:
    station = read_station("yumi")
    assert isinstance(station.robot, YumiConfig)
    assert station.motion.fast < read_station("simulated").motion.fast
