"""The real arm's driver against the emulated controller."""

from __future__ import annotations

import threading

import numpy as np
import pytest
from yumi_emulator import Arm, Controller, WebServices

from collection.clock import SimulatedClock
from collection.errors import (
    CollisionStopError,
    EmergencyStopError,
    JointLimitError,
    MotorsOffError,
    NotInAutoError,
    StaleReadingError,
    StoppedError,
    UnreachableError,
    UnsafeMotionError,
)
from collection.robots.planner import JointPath
from collection.robots.protocol import Path, Speed, Waypoint
from collection.robots.readings import ArmSample
from collection.robots.yumi.arm import YumiRobotArm
from collection.robots.yumi.config import YumiConfig
from collection.robots.yumi_arm import CONTROLLER_ORDER, yumi_arm
from reach.arrays import FloatArray
from reach.transforms import inverse, make_transform, rotation_about, rotation_angle

FAST, SLOW = Speed(0.25), Speed(0.05)
DOWN = rotation_about((1, 0, 0), np.pi)


def above(height: float, x: float = 0.38, y: float = -0.10) -> FloatArray:
    """The gripper pointing down, its frame at a height [m]."""
    return make_transform(DOWN, (x, y, height))


def off(T: FloatArray, T_other: FloatArray) -> tuple[float, float]:
    delta = inverse(T) @ T_other
    return float(np.linalg.norm(delta[:3, 3])), rotation_angle(delta[:3, :3])


@pytest.fixture
def over(arm: YumiRobotArm) -> YumiRobotArm:
    """The arm 0.35 m above the workspace, the way down to 0.275 m checked."""
    arm.check([Waypoint("over", above(0.35), Path.JOINT), Waypoint("down", above(0.275))])
    arm.move_to_pose(above(0.35), path=Path.JOINT, speed=FAST)
    return arm


@pytest.mark.parametrize("side", ["right", "left"])
def test_our_kinematics_and_tool0_are_the_controllers(side: str) -> None:
    # Home in programs made with ABB's own tool: tool0 in the base frame [mm], (w, x, y, z).
    y = -182.609892723 if side == "right" else 182.609892723
    sign = -1.0 if side == "right" else 1.0
    quat = (0.066010741, sign * 0.842421005, -0.11121506, sign * 0.523068488)
    from reach.transforms import rotation_from_quat_wxyz

    known = make_transform(rotation_from_quat_wxyz(quat), np.array([-9.5784, y, 198.6278]) / 1000)
    position, rotation = off(known, yumi_arm(side).chain.forward(yumi_arm(side).home))
    assert position < 0.002
    assert rotation < 0.005


def test_joints_are_reported_in_kinematic_order(arm: YumiRobotArm) -> None:
    assert np.degrees(arm.joints()) == pytest.approx([0, -130, -135, 30, 0, 40, 0], abs=1e-4)
    assert off(arm.pose(), arm.link_transforms(arm.joints())["gripper"])[0] < 0.002


def test_a_pose_is_reached_as_the_controller_measures_it(over: YumiRobotArm, right: Arm) -> None:
    motion = over.move_to_pose(above(0.275), speed=SLOW)
    assert off(motion.T_world_gripper, above(0.275))[0] < 1e-5
    reached = right.motion.chain.forward(right.motion.joints)[:3, 3]
    assert reached == pytest.approx([380, -100, 275], abs=0.01)
    assert (motion.end_ns - motion.start_ns) * 1e-9 == pytest.approx(0.075 / 0.05, abs=0.2)
    assert np.array_equal(motion.joints, over.joints())


def test_a_linear_motion_follows_the_line(over: YumiRobotArm) -> None:
    samples: list[ArmSample] = []
    over.move_to_pose(above(0.275), speed=SLOW, on_sample=samples.append)
    assert len(samples) > 10
    for sample in samples:
        x, y, z = sample.T_world_gripper[:3, 3]
        assert (x, y) == pytest.approx((0.38, -0.10), abs=0.003)  # our model, not the controller's
        assert 0.27 < z < 0.355
    times = [sample.time_ns for sample in samples]
    assert times == sorted(times)


def test_a_checked_motion_ends_in_the_checked_branch(over: YumiRobotArm) -> None:
    planned = over._checked[1][1].joints[-1]
    motion = over.move_to_pose(above(0.275), speed=SLOW)
    assert motion.joints == pytest.approx(planned, abs=0.03)


def test_joints_are_reached(arm: YumiRobotArm) -> None:
    goal = arm.description.home + np.array([0.1, 0.05, 0.1, -0.1, 0.2, 0.1, 0.3])
    motion = arm.move_to_joints(goal, speed=FAST)
    assert motion.joints == pytest.approx(goal, abs=1e-5)
    assert arm.home(speed=FAST).joints == pytest.approx(arm.description.home, abs=1e-5)


def test_the_joints_keep_their_share_of_speed(arm: YumiRobotArm) -> None:
    goal = arm.description.home.copy()
    goal[-1] += 1.0  # the wrist alone: the tool only turns
    motion = arm.move_to_joints(goal, speed=Speed(1.0, angular=6.0, joint=0.1))
    assert (motion.end_ns - motion.start_ns) * 1e-9 == pytest.approx(1.0 / 0.698, rel=0.1)


def test_a_guarded_motion_is_supervised_more_closely(over: YumiRobotArm, right: Arm) -> None:
    over.move_to_pose(above(0.275), speed=SLOW, guarded=True)
    assert right.motion.supervision == 50.0
    over.move_to_pose(above(0.35), speed=SLOW)
    assert right.motion.supervision == 100.0


def test_a_pose_out_of_reach_is_refused_before_anything_is_sent(
    arm: YumiRobotArm, services: WebServices, right: Arm
) -> None:
    before = right.motion.joints.copy()
    with pytest.raises(UnreachableError):
        arm.move_to_pose(above(0.3, x=1.5), path=Path.JOINT, speed=FAST)
    assert np.array_equal(right.motion.joints, before)


def test_a_pose_the_controller_cannot_reach_is_its_error(
    over: YumiRobotArm, right: Arm, monkeypatch: pytest.MonkeyPatch
) -> None:
    # The dry run believes in a pose that the controller's own kinematics does not reach.
    here = over.joints()
    believed = JointPath(np.array([here, here]), np.array([0.0, 1.0]))
    monkeypatch.setattr(over, "_path_to", lambda *_: believed)
    with pytest.raises(UnreachableError, match="outside its reach"):
        over.move_to_pose(above(0.3, x=1.5), speed=SLOW)
    assert over.joints() == pytest.approx(here)


def test_a_joint_beyond_its_limit_is_refused(arm: YumiRobotArm) -> None:
    goal = arm.description.home.copy()
    goal[2] = -3.0
    with pytest.raises(
        JointLimitError, match=r"joint_7 cannot go to -3\.0000 rad: limits -2\.9109"
    ):
        arm.move_to_joints(goal, speed=FAST)


def test_the_dry_run_refuses_the_table(over: YumiRobotArm) -> None:
    with pytest.raises((UnsafeMotionError, UnreachableError)):
        over.check([Waypoint("into the table", above(0.05))])


def test_reachability_is_asked_without_a_controller(arm: YumiRobotArm) -> None:
    arm.disconnect()
    far, near = above(0.3, x=1.5), above(0.3)
    assert arm.reachable(np.array([near, far])).tolist() == [True, False]


def test_a_collision_stops_lifts_and_is_an_error(
    over: YumiRobotArm, controller: Controller, right: Arm
) -> None:
    controller.faults.collide_at = 0.5
    with pytest.raises(CollisionStopError, match="lifted off"):
        over.move_to_pose(above(0.275), speed=SLOW, guarded=True)
    assert over.pose()[2, 3] == pytest.approx(0.3125 + 0.050, abs=0.002)
    over.clear_error()
    over.home(speed=FAST)


def test_a_collision_the_program_does_not_see_is_read_from_the_event_log(
    over: YumiRobotArm, controller: Controller
) -> None:
    controller.faults.collide_at, controller.faults.collision_handled = 0.5, False
    with pytest.raises(CollisionStopError, match="event 50204"):
        over.move_to_pose(above(0.275), speed=SLOW, guarded=True)
    with pytest.raises(StoppedError):  # the old event does not explain the next refusal
        over.move_to_pose(above(0.275), speed=SLOW)
    over.clear_error()
    assert controller.running
    over.home(speed=FAST)


def test_a_joint_7_that_is_not_updated_is_noticed_after_a_motion_of_joints(
    arm: YumiRobotArm, controller: Controller
) -> None:
    arm.joints()
    controller.faults.freeze_joint_7 = True
    goal = arm.description.home.copy()
    goal[2] += 0.3
    with pytest.raises(StaleReadingError, match=r"joint_7 .*unchanged since before"):
        arm.move_to_joints(goal, speed=FAST)


def test_a_joint_7_that_is_not_updated_is_noticed_after_a_motion_to_a_pose(
    over: YumiRobotArm, controller: Controller
) -> None:
    controller.faults.freeze_joint_7 = True
    with pytest.raises(StaleReadingError, match=r"joints that put the gripper .*joint_7"):
        over.move_to_pose(above(0.275), speed=SLOW)


def test_feedback_that_lags_a_little_is_waited_for(
    over: YumiRobotArm, controller: Controller
) -> None:
    controller.faults.feedback_lag = 0.4
    motion = over.move_to_pose(above(0.275), speed=SLOW)
    assert motion.joints == pytest.approx(_reported(controller), abs=1e-4)


def _reported(controller: Controller) -> FloatArray:
    joints = np.empty(7)
    joints[list(CONTROLLER_ORDER)] = controller.arms["T_ROB_R"].motion.joints
    return joints


def test_feedback_that_lags_too_long_is_an_error(arm: YumiRobotArm, controller: Controller) -> None:
    controller.faults.feedback_lag = 5.0
    goal = arm.description.home + 0.2
    goal[1] = arm.description.home[1] + 0.2
    with pytest.raises(StaleReadingError, match=r"1\.0 s after the motion"):
        arm.move_to_joints(goal, speed=Speed(1.0, 6.0, 1.0))


def test_a_lost_line_during_a_motion_costs_nothing(
    over: YumiRobotArm, controller: Controller, services: WebServices
) -> None:
    services.after_exchanges(5, lambda: setattr(controller.faults, "deaf", 1))
    motion = over.move_to_pose(above(0.275), speed=SLOW)
    assert controller.faults.deaf == 0
    assert off(motion.T_world_gripper, above(0.275))[0] < 1e-5


def test_stop_from_another_thread_stops_the_motion(
    over: YumiRobotArm, controller: Controller, clock: SimulatedClock, right: Arm
) -> None:
    begun = controller.time

    def stop_once(_: ArmSample) -> None:
        if controller.time - begun > 0.5 and controller.running:
            thread = threading.Thread(target=over.stop)
            thread.start()
            thread.join()

    with pytest.raises(StoppedError, match="by the operator"):
        over.move_to_pose(above(0.275), speed=SLOW, on_sample=stop_once)
    halted = right.motion.joints.copy()
    clock.sleep(5.0)
    assert np.array_equal(right.motion.joints, halted)
    for command in (over.clear_error, lambda: over.home(speed=FAST), over.connect):
        with pytest.raises(StoppedError):
            command()
        assert not controller.running
    over.release_stop()
    over.connect()
    over.home(speed=FAST)


def test_the_emergency_stop_waits_for_a_person(over: YumiRobotArm, controller: Controller) -> None:
    controller.emergency_stop()
    assert over.state().emergency_stop and not over.state().ready
    with pytest.raises(EmergencyStopError, match="release"):
        over.move_to_pose(above(0.275), speed=SLOW)
    with pytest.raises(EmergencyStopError):
        over.clear_error()
    controller.state = "motoroff"  # released and acknowledged
    over.clear_error()
    assert over.state().ready
    over.home(speed=FAST)


def test_motors_off_in_the_middle_is_said_and_cleared(
    over: YumiRobotArm, controller: Controller
) -> None:
    controller.state, controller.running = "motoroff", False
    with pytest.raises(MotorsOffError):
        over.move_to_pose(above(0.275), speed=SLOW)
    over.clear_error()
    assert controller.state == "motoron" and controller.running


def test_manual_mode_is_not_cleared_by_a_command(
    over: YumiRobotArm, controller: Controller
) -> None:
    controller.mode, controller.running = "MANR", False
    assert not over.state().automatic
    with pytest.raises(NotInAutoError, match="MANR"):
        over.clear_error()


def test_the_state_of_an_absent_controller_is_a_state(
    config: YumiConfig, clock: SimulatedClock
) -> None:
    from collection.robots.yumi.link import ControllerLink

    nowhere = config.model_copy(update={"address": "127.0.0.1:9", "request_timeout": 0.5})
    link = ControllerLink(nowhere, clock)
    arm = YumiRobotArm(link, lambda: None, make_transform())  # type: ignore[arg-type, return-value]
    state = arm.state()
    assert not state.connected and "127.0.0.1:9" in (state.error or "")
    arm.stop()  # safe when disconnected


def test_the_left_arm_is_the_left_one(
    services: WebServices, clock: SimulatedClock, station: object, controller: Controller
) -> None:
    from pathlib import Path as FilePath

    from collection.robots.yumi import build
    from collection.station.drivers import BuildContext

    config = YumiConfig(driver="yumi", address=services.address, side="left")
    arm, _ = build(config, BuildContext(station, clock, 0, FilePath.cwd()))
    with arm:
        goal = arm.description.home.copy()
        goal[-1] += 0.2
        arm.move_to_joints(goal, speed=FAST)
        assert arm.joints() == pytest.approx(goal, abs=1e-5)
    assert controller.arms["T_ROB_R"].motion.joints[5] == 0.0
    assert controller.arms["T_ROB_L"].motion.joints[5] == pytest.approx(0.2, abs=1e-5)
