"""An operator's stop on the real driver: in every phase, at every step of a recovery, and while
the sessions with the controller are being opened."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from yumi_emulator import Controller, WebServices

from collection.clock import SimulatedClock
from collection.errors import ConnectionLostError, StoppedError
from collection.robots.execution import Phase, PhaseEvent
from collection.robots.motion import execute_grasp, recover
from collection.robots.protocol import Speed
from collection.robots.yumi import YumiConfig
from collection.robots.yumi.arm import YumiRobotArm
from collection.robots.yumi.hand import SmartGripper
from collection.robots.yumi.link import ControllerLink
from collection.station.station import StationConfig
from reach.transforms import make_transform, rotation_about

GRASP = make_transform(
    rotation_about((0, 0, 1), 0.4) @ rotation_about((1, 0, 0), np.pi), (0.38, -0.10, 0.18)
)
Robot = tuple[YumiRobotArm, SmartGripper]
PHASES = [phase for phase in Phase if phase is not Phase.SHAKE]


@pytest.fixture
def config(services: WebServices) -> YumiConfig:
    """Few looks: these dialogues are long."""
    return YumiConfig(driver="yumi", address=services.address, poll_interval=0.25)


def assert_nothing_moves(robot: Robot, controller: Controller, clock: SimulatedClock) -> None:
    """Whatever motion code tries, and however much time passes."""
    right = controller.arms["T_ROB_R"]
    stopped_at = right.motion.joints.copy(), right.hand.position
    arm, hand = robot
    for attempt in (arm.clear_error, hand.open, lambda: recover(arm, hand), arm.connect):
        with pytest.raises(StoppedError):
            attempt()
        clock.sleep(2.0)
        assert not controller.running
        assert np.array_equal(right.motion.joints, stopped_at[0])
        assert right.hand.position == stopped_at[1]
    assert not arm.state().ready
    arm.release_stop()
    arm.connect()
    recover(arm, hand)
    assert arm.joints() == pytest.approx(arm.description.home, abs=1e-4)


@pytest.mark.parametrize("phase", PHASES)
def test_a_stop_in_any_phase_stands(
    robot: Robot,
    clock: SimulatedClock,
    station: StationConfig,
    controller: Controller,
    phase: Phase,
) -> None:
    controller.arms["T_ROB_R"].hand.object_width = 30.0

    def on_event(event: PhaseEvent) -> None:
        if event.phase is phase:
            robot[0].stop()

    with pytest.raises(StoppedError):
        execute_grasp(*robot, GRASP, clock, settings=station.motion, on_event=on_event)
    assert_nothing_moves(robot, controller, clock)


@pytest.mark.parametrize("exchange", [0, 3, 6, 9, 12, 15, 18, 21, 24, 27, 30])
def test_a_stop_at_any_exchange_of_a_recovery_stands(
    robot: Robot,
    clock: SimulatedClock,
    station: StationConfig,
    controller: Controller,
    services: WebServices,
    exchange: int,
) -> None:
    """The stop is pressed between two requests, wherever in clearing, rising, opening, homing."""
    robot[0].move_to_joints(robot[0].description.home + 0.2, speed=station.motion.careful())
    robot[0].halt()
    services.after_exchanges(exchange, robot[0]._link.latch.press)
    with pytest.raises(StoppedError):
        recover(*robot, station.motion)
    robot[0].stop()
    assert_nothing_moves(robot, controller, clock)


def during(act: Callable[[], None], link: ControllerLink, monkeypatch: pytest.MonkeyPatch) -> None:
    """Do something while `connect` opens the sessions: before its stop line is there."""
    connect = link.services.connect

    def opening() -> None:
        connect()
        act()

    monkeypatch.setattr(link.services, "connect", opening)


def test_a_stop_while_connecting_reaches_the_controller(
    robot: Robot, controller: Controller, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A motion may be under way that the lost session began; no program is started afterwards."""
    arm = robot[0]
    during(arm.stop, arm._link, monkeypatch)
    assert controller.running
    with pytest.raises(StoppedError):
        arm.connect()
    assert not controller.running
    monkeypatch.undo()
    with pytest.raises(StoppedError):
        arm.connect()
    assert not controller.running
    arm.release_stop()
    arm.connect()
    assert controller.running


def test_a_stop_that_cannot_reach_the_controller_while_connecting_is_said_and_remembered(
    robot: Robot, controller: Controller, monkeypatch: pytest.MonkeyPatch
) -> None:
    arm = robot[0]
    told: list[Exception] = []

    def press() -> None:
        controller.faults.deaf = 4
        with pytest.raises(ConnectionLostError) as caught:
            arm.stop()
        told.append(caught.value)
        controller.faults.deaf = 0

    during(press, arm._link, monkeypatch)
    with pytest.raises(StoppedError):
        arm.connect()
    assert told
    monkeypatch.undo()
    with pytest.raises(StoppedError):
        arm.connect()
    arm.release_stop()
    arm.connect()
    arm.home(speed=Speed(0.2))


def test_a_stop_that_its_own_line_cannot_bring_comes_by_the_other(
    robot: Robot, controller: Controller, clock: SimulatedClock, station: StationConfig
) -> None:
    """The motion's own thread looks at the stop, too, and stops the programs itself."""
    arm = robot[0]
    begun = controller.time

    def press(_: object) -> None:
        if controller.time - begun > 1.0:
            arm._link.latch.press()  # all that is left of a stop whose line is cut

    with pytest.raises(StoppedError):
        arm.move_to_joints(
            arm.description.home + 0.3, speed=station.motion.careful(), on_sample=press
        )
    assert not controller.running
