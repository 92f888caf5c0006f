"""Two programs and one arm: the second is refused before it writes a request."""

from __future__ import annotations

import os
from pathlib import Path

import pytest
from yumi_emulator import Controller

from collection.clock import SimulatedClock
from collection.errors import ControllerTakenError, NotInAutoError
from collection.robots.yumi import YumiConfig, build
from collection.robots.yumi.arm import YumiRobotArm
from collection.robots.yumi.hand import SmartGripper
from collection.station.drivers import BuildContext
from collection.station.station import StationConfig

Robot = tuple[YumiRobotArm, SmartGripper]


def other_robot(config: YumiConfig, station: StationConfig, clock: SimulatedClock) -> Robot:
    return build(config, BuildContext(station, clock, seed=0, folder=Path.cwd()))


def test_who_comes_second_is_refused_and_the_first_goes_on(
    robot: Robot, config: YumiConfig, station: StationConfig, clock: SimulatedClock
) -> None:
    _, hand = robot
    hand.open()
    second, second_hand = other_robot(config, station, clock)
    for device in (second, second_hand):
        with pytest.raises(ControllerTakenError, match=f"process {os.getpid()} of this computer"):
            device.connect()
    assert hand.close(5.0).width < hand.open().width
    with pytest.raises(ControllerTakenError):
        second.connect()  # also after a motion of the first


def test_the_next_leads_once_the_first_has_let_go_of_arm_and_hand(
    config: YumiConfig, station: StationConfig, clock: SimulatedClock
) -> None:
    first, first_hand = other_robot(config, station, clock)
    second, _ = other_robot(config, station, clock)
    first.connect()
    first_hand.connect()
    first.disconnect()
    with pytest.raises(ControllerTakenError):
        second.connect()
    first_hand.disconnect()
    second.connect()
    second.disconnect()


def test_a_refused_connection_leaves_the_arm_to_others(
    controller: Controller, config: YumiConfig, station: StationConfig, clock: SimulatedClock
) -> None:
    first, _ = other_robot(config, station, clock)
    second, _ = other_robot(config, station, clock)
    controller.mode = "MANR"
    with pytest.raises(NotInAutoError):
        first.connect()
    controller.mode = "AUTO"
    second.connect()
    second.disconnect()
