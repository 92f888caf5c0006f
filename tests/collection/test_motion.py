"""The trial motion on the simulated station: phases, verdicts, dry run, safety."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest
import trimesh

from collection.errors import CollisionStopError, RobotError, UnreachableError
from collection.robots.execution import Execution, Phase, PhaseEvent
from collection.robots.motion import can_execute, dry_run, execute_grasp, reachable_grasps
from collection.robots.motion_settings import MotionSettings
from collection.robots.waypoints import approach_pose, shake_poses, trial_waypoints
from collection.station.station import (
    PACKAGED,
    Station,
    build_station,
    load_station,
    parse_station,
)
from reach.gripper import ParallelJawGripper
from reach.objects import GraspObject
from reach.stable_poses import StablePose
from reach.transforms import inverse, make_transform, rotation_about, rotation_angle

MESH = trimesh.creation.box((0.03, 0.03, 0.03))
CUBE = GraspObject("cube", MESH.vertices, MESH.faces, 0.01)
RESTING = StablePose(0, 1.0, make_transform(None, (0, 0, 0.015)))
T_OBJECT_GRIPPER = make_transform(np.diag([1.0, -1.0, -1.0]), (0, 0, 0.160098))


@pytest.fixture
def station() -> Iterator[Station]:
    with load_station("simulated", seed=4) as each:
        yield each


def place(station: Station, obj: GraspObject = CUBE, seed: int = 0) -> np.ndarray:
    simulation = station.simulation
    assert simulation is not None
    height = -float(obj.vertices[:, 2].min())
    resting = StablePose(0, 1.0, make_transform(None, (0, 0, height)))
    simulation.place(obj, resting, np.random.default_rng(seed))
    return np.array(simulation.true_T_world_object() @ T_OBJECT_GRIPPER)


def run(station: Station, T: np.ndarray, **settings: object) -> Execution:
    return execute_grasp(
        station.arm, station.gripper, T, station.clock, settings=MotionSettings(**settings)
    )


def test_a_good_grasp_is_lifted_and_both_verdicts_agree(station: Station) -> None:
    T = place(station)
    events: list[PhaseEvent] = []
    execution = execute_grasp(
        station.arm, station.gripper, T, station.clock, on_event=events.append
    )
    assert station.simulation is not None
    verdict = station.simulation.verdict()
    assert verdict.lifted and not verdict.rotated
    assert verdict.held_seconds >= 1.0
    assert execution.sensor_verdict.lifted
    assert execution.sensor_verdict.width_held == pytest.approx(0.03, abs=3e-3)
    assert execution.sensor_verdict.force_held == pytest.approx(20.0, abs=3.0)
    order = [span.phase for span in execution.phases]
    assert order == [event.phase for event in events]
    assert order == [phase for phase in Phase if phase is not Phase.SHAKE]
    ends = [span.end_ns for span in execution.phases]
    assert all(a.start_ns >= end for a, end in zip(execution.phases[1:], ends, strict=False))


def test_the_trace_covers_the_motion(station: Station) -> None:
    execution = run(station, place(station))
    times = np.array([sample.time_ns for sample in execution.samples])
    assert np.all(np.diff(times) > 0)
    assert np.diff(times).max() < 0.2e9
    heights = np.array([sample.T_world_gripper[2, 3] for sample in execution.samples])
    lift = next(span for span in execution.phases if span.phase is Phase.LIFT)
    lifting = heights[(times >= lift.start_ns) & (times <= lift.end_ns)]
    assert np.ptp(lifting) > 0.08
    widths = np.array([sample.width for sample in execution.samples])
    assert widths.max() == pytest.approx(0.05, abs=2e-3)
    assert widths.min() == pytest.approx(0.029, abs=2e-3)


def test_the_hold_lasts_at_least_a_second(station: Station) -> None:
    execution = run(station, place(station))
    hold = next(span for span in execution.phases if span.phase is Phase.HOLD)
    assert (hold.end_ns - hold.start_ns) * 1e-9 >= 1.0


def test_a_miss_is_a_failure_not_an_error(station: Station) -> None:
    T = place(station) @ make_transform(None, (0, 0.05, 0))  # beside the cube
    execution = run(station, np.array(T))
    assert station.simulation is not None
    assert not execution.sensor_verdict.lifted
    assert not station.simulation.verdict().lifted
    assert execution.sensor_verdict.width_closed < 1e-3


@pytest.mark.parametrize("thickness", [0.0015, 0.003])
def test_a_thin_part_that_is_lifted_is_seen_by_the_hand(station: Station, thickness: float) -> None:
    """Both pads give way around it until they meet; the jaws still rest wider than on nothing."""
    mesh = trimesh.creation.box((thickness, 0.03, 0.03))
    plate = GraspObject("plate", mesh.vertices, mesh.faces, 0.005)
    T = place(station, plate) @ make_transform(None, (0, 0, -0.018))  # by its rim, 7 mm deep
    execution = run(station, np.array(T))
    assert station.simulation is not None
    assert station.simulation.verdict().lifted
    assert execution.sensor_verdict.lifted
    assert execution.sensor_verdict.width_held < thickness


def test_a_bar_held_near_its_end_turns_and_counts_as_lifted_but_rotated() -> None:
    mesh = trimesh.creation.box((0.02, 0.10, 0.02))
    bar = GraspObject("bar", mesh.vertices, mesh.faces, 0.4)  # 157 N mm about the pads
    text = (
        (PACKAGED / "simulated.toml")
        .read_text()
        .replace("friction = [0.3, 0.6]", "friction = [0.5, 0.5]", 1)
    )
    text = text.replace("pad_modulus = [0.4e6, 0.9e6]", "pad_modulus = [0.6e6, 0.6e6]", 1)
    with build_station(parse_station(text, "test.toml"), text, PACKAGED, 0) as station:
        T = place(station, bar, seed=2) @ make_transform(None, (0, 0.04, 0))
        execution = run(station, np.array(T), lift_height=0.2)
        assert station.simulation is not None
        verdict = station.simulation.verdict()
    assert execution.sensor_verdict.lifted
    assert verdict.lifted and verdict.rotated
    assert verdict.turned > np.radians(20)


def test_a_part_too_heavy_to_hold_stays_down(station: Station) -> None:
    heavy = GraspObject("heavy", MESH.vertices, MESH.faces, 4.0)
    execution = run(station, place(station, heavy))
    assert station.simulation is not None
    verdict = station.simulation.verdict()
    assert not verdict.lifted and verdict.highest < 0.05
    assert not execution.sensor_verdict.lifted


def test_shaking_is_part_of_the_trial_if_asked_for(station: Station) -> None:
    execution = run(station, place(station), shake=True, shake_cycles=2)
    assert Phase.SHAKE in [span.phase for span in execution.phases]
    assert station.simulation is not None
    assert station.simulation.verdict().lifted


def test_shake_poses_turn_about_an_axis_behind_the_pads() -> None:
    settings = MotionSettings(shake_cycles=3)
    T = make_transform(np.diag([1.0, -1.0, -1.0]), (0.4, 0.0, 0.4))
    poses = shake_poses(T, ParallelJawGripper.yumi(), settings)
    assert len(poses) == 7
    pivot = np.array([0.0, 0.0, 0.160098 - 0.2, 1.0])
    for pose in poses:
        np.testing.assert_allclose(pose @ pivot, T @ pivot, atol=1e-12)
    angle = rotation_angle((inverse(T) @ poses[0])[:3, :3])
    assert angle == pytest.approx(0.03 * np.pi)
    np.testing.assert_array_equal(poses[-1], T)


def test_the_approach_comes_along_the_approach_axis() -> None:
    tilted = make_transform(
        rotation_about((0, 1, 0), 0.4) @ np.diag([1.0, -1.0, -1.0]), (0.4, 0, 0.2)
    )
    back = approach_pose(tilted, MotionSettings(approach_distance=0.075))
    np.testing.assert_allclose(tilted[:3, 3] - back[:3, 3], 0.075 * tilted[:3, 2], atol=1e-12)
    names = [waypoint.name for waypoint in trial_waypoints(tilted, MotionSettings())]
    way = ["avoidance", "approach", "grasp", "lift", "put down", "retreat", "leave"]
    assert names == way


def test_the_dry_run_refuses_before_anything_moves(station: Station) -> None:
    T = np.array(place(station))
    T[0, 3] += 1.0
    before = station.arm.joints()
    assert not reachable_grasps(station.arm, T[None])[0]
    assert not can_execute(station.arm, T)
    with pytest.raises(UnreachableError, match="avoidance"):
        dry_run(station.arm, T)
    with pytest.raises(RobotError):
        run(station, T)
    np.testing.assert_allclose(
        station.simulation.joints if station.simulation else before, before, atol=1e-3
    )


def test_a_failure_of_the_listener_leaves_the_robot_stopped(station: Station) -> None:
    def fail(event: PhaseEvent) -> None:
        if event.phase is Phase.LIFT:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        execute_grasp(station.arm, station.gripper, place(station), station.clock, on_event=fail)
    with pytest.raises(RobotError, match="stopped"):
        station.arm.joints()


def test_the_same_seed_gives_the_same_trial() -> None:
    executions = []
    for seed in (4, 4, 5):
        with load_station("simulated", seed=seed) as station:
            executions.append(run(station, place(station)))
    first, same, other = executions
    assert len(first.samples) == len(same.samples)
    for a, b in zip(first.samples, same.samples, strict=True):
        assert (a.time_ns, a.width, a.force) == (b.time_ns, b.width, b.force)
        np.testing.assert_array_equal(a.joints, b.joints)
    assert first.sensor_verdict.width_held != other.sensor_verdict.width_held


def test_fingertips_that_meet_the_table_end_the_approach_there(station: Station) -> None:
    """A registered pose that errs downward by a millimeter or two voids no trial."""
    T = place(station) @ make_transform(None, (0, 0, 0.0065))  # tips 1.5 mm below the table
    execution = run(station, np.array(T))
    assert station.simulation is not None
    assert station.simulation.verdict().lifted
    raised = execution.T_world_gripper[2, 3] - execution.T_world_gripper_planned[2, 3]
    assert 0.0 < raised < 3e-3


def test_an_approach_blocked_further_up_is_a_collision(station: Station) -> None:
    T = place(station) @ make_transform(None, (0.028, 0, 0))
    with pytest.raises(CollisionStopError, match="mm before the grasp"):
        run(station, np.array(T))
