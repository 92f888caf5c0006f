"""The trial motion of the station, on the real driver and the emulated controller."""

from __future__ import annotations

import numpy as np
import pytest
from yumi_emulator import Arm, Controller, WebServices

from collection.clock import SimulatedClock
from collection.errors import CollisionStopError, ConnectionLostError, Recovery
from collection.robots.execution import Phase, PhaseEvent
from collection.robots.motion import dry_run, execute_grasp, recover
from collection.robots.yumi import YumiConfig
from collection.robots.yumi.arm import YumiRobotArm
from collection.robots.yumi.hand import SmartGripper
from collection.station.station import StationConfig
from reach.arrays import FloatArray
from reach.transforms import make_transform, rotation_about

GRASP = make_transform(
    rotation_about((0, 0, 1), 0.4) @ rotation_about((1, 0, 0), np.pi), (0.38, -0.10, 0.18)
)
Robot = tuple[YumiRobotArm, SmartGripper]


def grasp(
    robot: Robot,
    clock: SimulatedClock,
    station: StationConfig,
    at: dict[Phase, object] | None = None,
):  # type: ignore[no-untyped-def]
    def on_event(event: PhaseEvent) -> None:
        act = (at or {}).get(event.phase)
        if callable(act):
            act()

    return execute_grasp(*robot, GRASP, clock, settings=station.motion, on_event=on_event)


@pytest.fixture
def config(services: WebServices) -> YumiConfig:
    """Few looks: these dialogues are long."""
    return YumiConfig(driver="yumi", address=services.address, poll_interval=0.25)


@pytest.fixture
def part(right: Arm) -> Arm:
    """A part of 30 mm stands in the jaws' way."""
    right.hand.object_width = 30.0
    return right


def test_a_whole_trial(
    robot: Robot, clock: SimulatedClock, station: StationConfig, part: Arm
) -> None:
    dry_run(robot[0], GRASP, station.motion)
    execution = grasp(robot, clock, station)
    assert execution.sensor_verdict.lifted
    assert execution.sensor_verdict.width_closed == pytest.approx(0.030)
    assert np.abs(execution.T_world_gripper - GRASP).max() < 1e-4
    assert part.hand.calibrations == 1  # found out at the first opening
    heights = [sample.T_world_gripper[2, 3] for sample in execution.samples]
    assert max(heights) > GRASP[2, 3] + 0.09
    held = [s.width for s in execution.samples if s.T_world_gripper[2, 3] > GRASP[2, 3] + 0.09]
    assert len(held) > 5
    assert part.motion.joints is not None and part.hand.force == 0.0


def test_a_part_that_slips_out_during_the_lift_is_seen_in_the_width(
    robot: Robot, clock: SimulatedClock, station: StationConfig, part: Arm
) -> None:
    def lose() -> None:
        part.hand.position = 0.0  # the jaws close on nothing

    execution = grasp(robot, clock, station, {Phase.HOLD: lose})
    assert not execution.sensor_verdict.lifted
    assert execution.sensor_verdict.width_closed == pytest.approx(0.030)


def test_a_line_lost_in_the_lift_does_not_disturb_the_trial(
    robot: Robot,
    clock: SimulatedClock,
    station: StationConfig,
    part: Arm,
    controller: Controller,
    services: WebServices,
) -> None:
    def cut() -> None:
        services.after_exchanges(5, lambda: setattr(controller.faults, "drop_after", 1))

    assert grasp(robot, clock, station, {Phase.LIFT: cut}).sensor_verdict.lifted
    assert controller.faults.drop_after == 0


def test_a_line_that_stays_lost_ends_the_attempt_and_is_retried_after_connecting(
    robot: Robot,
    clock: SimulatedClock,
    station: StationConfig,
    part: Arm,
    controller: Controller,
) -> None:
    def cut() -> None:
        controller.faults.deaf = 10_000

    with pytest.raises(ConnectionLostError) as caught:
        grasp(robot, clock, station, {Phase.LIFT: cut})
    assert caught.value.recovery is Recovery.RETRY
    controller.faults.deaf = 0
    for device in robot:
        device.connect()
    recover(*robot, station.motion)
    assert grasp(robot, clock, station).sensor_verdict.lifted


def test_a_collision_on_the_way_down_stops_everything_and_is_recovered(
    robot: Robot,
    clock: SimulatedClock,
    station: StationConfig,
    part: Arm,
    controller: Controller,
) -> None:
    def meet() -> None:
        controller.faults.collide_at = 0.6

    with pytest.raises(CollisionStopError):
        grasp(robot, clock, station, {Phase.DESCEND: meet})
    assert not controller.running
    recover(*robot, station.motion)
    home: FloatArray = robot[0].description.home
    assert robot[0].joints() == pytest.approx(home, abs=1e-4)
    assert part.hand.position == pytest.approx(25.0)
    assert grasp(robot, clock, station).sensor_verdict.lifted
