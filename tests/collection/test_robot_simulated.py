"""The simulated arm and hand: verbs, noise, errors, and faults on schedule."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest
import trimesh

from collection.cell.faults import Fault, FaultKind
from collection.errors import (
    CollisionStopError,
    ConnectionLostError,
    EmergencyStopError,
    GripperNotCalibratedError,
    JointLimitError,
    NotConnectedError,
    Recovery,
    RobotTimeoutError,
    StoppedError,
)
from collection.robots.motion import execute_grasp, recover
from collection.robots.protocol import Speed
from collection.station.station import Station, load_station
from reach.objects import GraspObject
from reach.stable_poses import StablePose
from reach.transforms import inverse, make_transform

FAST = Speed(0.3)


def cube() -> GraspObject:
    mesh = trimesh.creation.box((0.03, 0.03, 0.03))
    return GraspObject("cube", mesh.vertices, mesh.faces, 0.01)


CUBE = cube()
RESTING = StablePose(0, 1.0, make_transform(None, (0, 0, 0.015)))
T_OBJECT_GRIPPER = make_transform(np.diag([1.0, -1.0, -1.0]), (0, 0, 0.160098))


@pytest.fixture
def station() -> Iterator[Station]:
    with load_station("simulated", seed=4) as each:
        yield each


def place(station: Station, seed: int = 0) -> np.ndarray:
    """Put the cube down; returns T_world_gripper of a grasp from above."""
    simulation = station.simulation
    assert simulation is not None
    simulation.place(CUBE, RESTING, np.random.default_rng(seed))
    return np.array(simulation.true_T_world_object() @ T_OBJECT_GRIPPER)


def script(station: Station, kind: FaultKind) -> None:
    assert station.simulation is not None
    station.simulation.faults.add(Fault(kind, station.simulation.attempt))


def run(station: Station, T_world_gripper: np.ndarray) -> object:
    return execute_grasp(station.arm, station.gripper, T_world_gripper, station.clock)


def test_commands_need_a_connection() -> None:
    station = load_station("simulated")
    assert not station.arm.state().ready
    assert station.arm.description.joint_names[2] == "joint_7"  # readable while disconnected
    with pytest.raises(NotConnectedError):
        station.arm.joints()
    with pytest.raises(NotConnectedError):
        station.gripper.open()


def test_joint_motion_reports_what_was_executed(station: Station) -> None:
    target = station.arm.description.home + 0.1
    motion = station.arm.move_to_joints(target, speed=FAST)
    np.testing.assert_allclose(motion.joints, target, atol=1e-3)
    assert np.any(motion.joints != target)  # measured, with noise
    assert motion.end_ns - motion.start_ns > 50_000_000
    samples = []
    station.arm.home(speed=FAST, on_sample=samples.append)
    assert len(samples) >= 2
    assert all(a.time_ns < b.time_ns for a, b in zip(samples, samples[1:], strict=False))


def test_a_slower_speed_takes_longer(station: Station) -> None:
    target = station.arm.description.home + 0.2
    durations = []
    for share in (0.5, 0.1):
        motion = station.arm.move_to_joints(target, speed=Speed(10.0, 10.0, share))
        durations.append(motion.end_ns - motion.start_ns)
        station.arm.home(speed=FAST)
    assert durations[1] > 4 * durations[0]


def test_a_joint_beyond_its_limit_is_refused(station: Station) -> None:
    before = station.arm.joints()
    target = np.array(station.arm.description.home)
    target[1] = 1.0
    with pytest.raises(JointLimitError, match=r"joint_2 .* 0\.7592"):
        station.arm.move_to_joints(target, speed=FAST)
    np.testing.assert_allclose(station.arm.joints(), before, atol=1e-3)


def test_the_hand_closes_on_nothing_and_opens_again(station: Station) -> None:
    closed = station.gripper.close(20.0)
    assert closed.width < 1e-4
    assert station.gripper.open(0.03).width == pytest.approx(0.03, abs=2e-3)
    assert station.gripper.open().width == pytest.approx(0.05, abs=1e-3)


def test_closing_takes_as_long_as_the_jaws_need(station: Station) -> None:
    place(station)  # physics runs, the hand is far from the cube
    station.gripper.open()
    closed = station.gripper.close(20.0)
    seconds = (closed.end_ns - closed.start_ns) * 1e-9
    assert 1.2 < seconds < 1.6  # 25 mm at 20 mm/s, and a moment to rest


def test_a_stop_stands_until_it_is_released(station: Station) -> None:
    station.arm.stop()
    for command in (station.arm.clear_error, lambda: station.arm.home(speed=FAST)):
        with pytest.raises(StoppedError):
            command()
    station.arm.release_stop()
    assert not station.arm.state().ready  # like a real one, it wants its error cleared
    station.arm.clear_error()
    station.arm.home(speed=FAST)


def test_a_halt_lasts_until_the_error_is_cleared(station: Station) -> None:
    station.gripper.halt()
    with pytest.raises(StoppedError, match="after a failure"):
        station.arm.home(speed=FAST)
    station.arm.clear_error()
    station.arm.home(speed=FAST)


def test_stop_ends_a_motion_under_way(station: Station) -> None:
    target = station.arm.description.home + 0.3
    with pytest.raises(StoppedError):
        station.arm.move_to_joints(target, speed=FAST, on_sample=lambda _: station.arm.stop())
    station.arm.release_stop()
    station.arm.clear_error()
    assert np.abs(station.arm.joints() - target).max() > 0.1


def test_the_hand_goes_where_the_arm_believes_but_for_hidden_errors(station: Station) -> None:
    T = place(station)
    station.arm.check([])
    station.arm.home(speed=FAST)
    above = np.array(make_transform(None, (0, 0, 0.15)) @ T)
    motion = station.arm.move_to_pose(above, speed=FAST, path="joint")
    assert station.simulation is not None
    truth = station.simulation.true_T_world_gripper()
    error = (inverse(motion.T_world_gripper) @ truth)[:3, 3]
    assert 1e-5 < np.linalg.norm(error) < 5e-3
    np.testing.assert_allclose(motion.T_world_gripper[:3, 3], above[:3, 3], atol=2e-3)


def test_a_finger_that_lands_on_the_part_stops_the_arm(station: Station) -> None:
    T = place(station)
    onto = T @ make_transform(None, (0.028, 0, 0))  # a finger comes down on the cube
    with pytest.raises(CollisionStopError, match="N"):
        run(station, np.array(onto))
    assert station.arm.state().error is not None
    recover(station.arm, station.gripper)
    assert station.arm.state().ready


@pytest.mark.parametrize(
    ("kind", "error"),
    [
        (FaultKind.CONNECTION_LOST, ConnectionLostError),
        (FaultKind.COLLISION_STOP, CollisionStopError),
        (FaultKind.GRIPPER_NOT_CALIBRATED, GripperNotCalibratedError),
        (FaultKind.EMERGENCY_STOP, EmergencyStopError),
    ],
)
def test_a_scripted_fault_happens_once_and_leaves_the_robot_stopped(
    station: Station, kind: FaultKind, error: type[Exception]
) -> None:
    T = place(station)
    script(station, kind)
    with pytest.raises(error):
        run(station, T)
    assert not station.arm.state().ready
    if kind is FaultKind.EMERGENCY_STOP:
        with pytest.raises(EmergencyStopError, match="still pressed"):
            station.arm.clear_error()
        station.clock.sleep(6.0)  # somebody releases it
    if kind is FaultKind.CONNECTION_LOST:
        station.arm.connect()
        station.gripper.connect()
    recover(station.arm, station.gripper)
    execution = run(station, place(station, seed=1))
    assert execution.sensor_verdict.lifted  # type: ignore[attr-defined]


def test_errors_say_what_a_session_should_do() -> None:
    assert ConnectionLostError.recovery is Recovery.RETRY
    assert GripperNotCalibratedError.recovery is Recovery.RETRY
    assert CollisionStopError.recovery is Recovery.VOID
    assert EmergencyStopError.recovery is Recovery.HALT


def test_a_scripted_slip_drops_the_part(station: Station) -> None:
    T = place(station)
    script(station, FaultKind.SLIP)
    execution = run(station, T)
    assert station.simulation is not None
    assert not station.simulation.verdict().lifted
    assert not execution.sensor_verdict.lifted  # type: ignore[attr-defined]


@pytest.mark.parametrize(("force", "grips"), [(19.0, True), (0.1, False)])
def test_a_creeping_part_ends_the_closing_and_a_jammed_hand_does_not(
    station: Station, monkeypatch: pytest.MonkeyPatch, force: float, grips: bool
) -> None:
    simulation = station.simulation
    assert simulation is not None
    monkeypatch.setattr(type(simulation), "jaw_speed", property(lambda _: 1e-3))
    monkeypatch.setattr(type(simulation), "grip_force", property(lambda _: force))
    if grips:
        motion = station.gripper.close(20.0)
        assert (motion.end_ns - motion.start_ns) * 1e-9 == pytest.approx(2.0, abs=0.2)
    else:
        with pytest.raises(RobotTimeoutError, match="did not come to rest"):
            station.gripper.close(20.0)
