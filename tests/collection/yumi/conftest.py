"""The emulated controller, for the tests of the real driver."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from importlib.resources import files
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parent))  # the emulator is no part of the product

from yumi_emulator import Arm, Controller, WebServices
from yumi_emulator.language import Module, parse_module

from collection.clock import SimulatedClock
from collection.robots.yumi import YumiConfig, build
from collection.robots.yumi.arm import YumiRobotArm
from collection.robots.yumi.hand import SmartGripper
from collection.station.drivers import BuildContext
from collection.station.station import StationConfig, read_station


@pytest.fixture(scope="session")
def rapid_text() -> str:
    return (files("collection.robots.yumi") / "reach_trials.mod").read_text(encoding="ascii")


@pytest.fixture(scope="session")
def rapid_module(rapid_text: str) -> Module:
    return parse_module(rapid_text)


@pytest.fixture
def controller(rapid_module: Module) -> Controller:
    return Controller(rapid_module)


@pytest.fixture
def services(controller: Controller) -> Iterator[WebServices]:
    with WebServices(controller) as running:
        yield running


@pytest.fixture
def clock(controller: Controller) -> SimulatedClock:
    """A clock the emulated controller follows."""
    clock = SimulatedClock()
    clock.follow(controller.advance)
    return clock


@pytest.fixture
def config(services: WebServices) -> YumiConfig:
    return YumiConfig(driver="yumi", address=services.address)


@pytest.fixture(scope="session")
def station() -> StationConfig:
    return read_station("yumi")


@pytest.fixture
def robot(
    station: StationConfig, config: YumiConfig, clock: SimulatedClock
) -> Iterator[tuple[YumiRobotArm, SmartGripper]]:
    """Arm and hand as a station builds them, connected to the emulated controller."""
    context = BuildContext(station, clock, seed=0, folder=Path.cwd())
    arm, hand = build(config, context)
    with arm, hand:
        yield arm, hand


@pytest.fixture
def arm(robot: tuple[YumiRobotArm, SmartGripper]) -> YumiRobotArm:
    return robot[0]


@pytest.fixture
def hand(robot: tuple[YumiRobotArm, SmartGripper]) -> SmartGripper:
    return robot[1]


@pytest.fixture
def right(controller: Controller) -> Arm:
    """The emulated right arm."""
    return controller.arms["T_ROB_R"]
