"""Kinematics, reach and planning of the simulated YuMi."""

from __future__ import annotations

from functools import cache

import mujoco
import numpy as np
import pytest

from collection.errors import RobotError, UnreachableError, UnsafeMotionError
from collection.robots.arm_model import arm_model
from collection.robots.chain_kernels import fill_jacobian, fill_tip_error
from collection.robots.planner import ArmPlanner
from collection.robots.protocol import Path, Waypoint
from collection.robots.reach_search import solve_many, start_configurations
from collection.robots.yumi_arm import CONTROLLER_ORDER, JOINT_NAMES, yumi_arm
from reach.gripper import ParallelJawGripper
from reach.transforms import exp, make_transform, rotation_about

YUMI = ParallelJawGripper.yumi()


@cache
def planner() -> ArmPlanner:
    return ArmPlanner(yumi_arm("right"), YUMI, make_transform(), 0.0)


def from_above(x: float, y: float, z: float, yaw: float = 0.0, tilt: float = 0.0) -> np.ndarray:
    """T_world_gripper whose pads' centers are at (x, y, z)."""
    rotation = rotation_about((0, 0, 1), yaw) @ rotation_about((0, 1, 0), tilt)
    rotation = rotation @ np.diag([1.0, -1.0, -1.0])
    return np.array(make_transform(rotation, np.array([x, y, z]) - 0.160098 * rotation[:, 2]))


def tip_error(T: np.ndarray, T_target: np.ndarray) -> np.ndarray:
    error = np.empty(6)
    fill_tip_error(np.array(T), np.array(T_target), error)
    return error


def test_home_puts_the_flange_where_the_maker_says() -> None:
    """At home the YuMi's wrists are near (-10, -/+182, 198) mm, mirrored."""
    for side, sign in (("right", -1.0), ("left", 1.0)):
        arm = yumi_arm(side)
        position = arm.chain.forward(arm.home)[:3, 3]
        np.testing.assert_allclose(position, (-0.010, sign * 0.182, 0.197), atol=2e-3)


def test_the_controllers_order_is_1_to_6_then_7() -> None:
    ordered = [JOINT_NAMES[n] for n in CONTROLLER_ORDER]
    assert ordered == [f"joint_{n}" for n in (1, 2, 3, 4, 5, 6, 7)]


def test_the_mujoco_model_agrees_with_the_chain() -> None:
    arm = yumi_arm("left")
    T_world_base = make_transform(rotation_about((0, 0, 1), 0.3), (0.1, -0.2, 0.05))
    model = arm_model(arm, YUMI, T_world_base, 0.0).model
    data = mujoco.MjData(model)
    rng = np.random.default_rng(0)
    for _ in range(5):
        joints = rng.uniform(arm.chain.lower, arm.chain.upper)
        data.qpos[:] = joints
        mujoco.mj_kinematics(model, data)
        T = T_world_base @ arm.chain.forward(joints)
        np.testing.assert_allclose(data.body("gripper").xpos, T[:3, 3], atol=1e-12)
        np.testing.assert_allclose(data.body("gripper").xmat.reshape(3, 3), T[:3, :3], atol=1e-12)


def test_the_jacobian_is_the_derivative_of_the_forward_kinematics() -> None:
    chain = yumi_arm("right").chain
    rng = np.random.default_rng(1)
    joints = rng.uniform(chain.lower, chain.upper)
    J = np.empty((6, len(chain)))
    fill_jacobian(chain.link_frames(joints), J)
    for column in range(len(chain)):
        step = np.zeros(len(chain))
        step[column] = 1e-6
        ahead, behind = chain.forward(joints + step), chain.forward(joints - step)
        difference = tip_error(behind, ahead) / 2e-6
        np.testing.assert_allclose(J[:, column], difference, atol=1e-6)


def test_the_error_of_a_pose_is_its_twist_in_base_axes() -> None:
    T = from_above(0.4, 0.0, 0.1, yaw=0.7)
    twist = np.array([0.02, -0.01, 0.03, 0.001, 0.002, -0.003])
    moved = T.copy()
    moved[:3, :3] = exp(np.concatenate([twist[:3], np.zeros(3)]))[:3, :3] @ T[:3, :3]
    moved[:3, 3] += twist[3:]
    np.testing.assert_allclose(tip_error(T, moved), twist, atol=1e-9)


def test_solutions_reach_their_poses_within_limits() -> None:
    arm = yumi_arm("right")
    rng = np.random.default_rng(2)
    poses = np.array(
        [from_above(0.38, -0.1, 0.05, rng.uniform(-3, 3), rng.uniform(0, 0.6)) for _ in range(20)]
    )
    joints, solved = solve_many(arm.chain, poses, start_configurations(arm.chain, arm.home, 6, 0))
    assert solved.any(axis=1).all()
    for row in range(len(poses)):
        for solution in joints[row, solved[row]]:
            assert np.all(solution >= arm.chain.lower - 1e-9)
            assert np.all(solution <= arm.chain.upper + 1e-9)
            error = tip_error(arm.chain.forward(solution), poses[row])
            assert np.linalg.norm(error[:3]) < 1e-3
            assert np.linalg.norm(error[3:]) < 1e-4


def test_reach_ends_where_the_arm_ends_and_at_the_table() -> None:
    poses = np.array(
        [
            from_above(0.38, -0.1, 0.05),
            from_above(1.20, -0.1, 0.05),  # further than the arm is long
            from_above(0.38, -0.1, -0.03),  # fingers in the table
            from_above(-0.10, 0.0, 0.05),  # inside the robot's body
        ]
    )
    assert planner().reachable(poses).tolist() == [True, False, False, False]


def test_a_plan_follows_its_lines() -> None:
    start = planner().arm.home
    grasp = from_above(0.38, -0.1, 0.02)
    above = from_above(0.38, -0.1, 0.15)
    paths = planner().plan(
        [Waypoint("above", above, Path.JOINT), Waypoint("grasp", grasp, Path.LINEAR)], start
    )
    np.testing.assert_allclose(paths[0].joints[0], start)
    np.testing.assert_allclose(paths[0].joints[-1], paths[1].joints[0])
    positions = planner().forward(paths[1].joints)[:, :3, 3]
    np.testing.assert_allclose(
        positions[:, :2], np.tile(grasp[:2, 3], (len(positions), 1)), atol=2e-4
    )
    assert np.all(np.diff(positions[:, 2]) < 0)
    between = 0.5 * (paths[1].joints[1:] + paths[1].joints[:-1])
    off_line = planner().forward(between)[:, :2, 3] - grasp[:2, 3]
    assert np.abs(off_line).max() < 1e-3  # joint interpolation leaves the line by less than 1 mm


def test_an_unreachable_waypoint_is_named() -> None:
    far = Waypoint("lift", from_above(1.2, 0.0, 0.3), Path.LINEAR)
    near = Waypoint("grasp", from_above(0.38, -0.1, 0.05), Path.JOINT)
    with pytest.raises(UnreachableError, match="'lift'"):
        planner().plan([near, far], planner().arm.home)


def test_a_motion_through_the_table_is_unsafe() -> None:
    above = Waypoint("above", from_above(0.38, -0.1, 0.1), Path.JOINT)
    below = Waypoint("below", from_above(0.38, -0.1, 0.0), Path.LINEAR)
    with pytest.raises(RobotError, match="'below'") as raised:
        planner().plan([above, below], planner().arm.home)
    assert isinstance(raised.value, UnsafeMotionError | UnreachableError)


def test_the_description_places_every_shape() -> None:
    description = planner().description
    links = planner().link_transforms(description.home)
    assert {shape.link for shape in description.shapes} <= set(links)
    np.testing.assert_array_equal(links["gripper"], planner().forward(description.home))
    assert mujoco.MjModel.from_xml_string(description.mjcf).nq == 7
