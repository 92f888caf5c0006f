"""The pin world passes the physical checks that a grasp simulator must pass."""

from __future__ import annotations

import os

import numpy as np
import pytest
import trimesh

from reach.gripper import ParallelJawGripper
from reach.objects import GraspObject
from reach.scene import Scene
from reach.transforms import (
    exp,
    inverse,
    make_transform,
    rotation_about,
    rotation_angle,
)
from reach.world.grasp_world import GraspWorld
from reach.world.parameters import WorldParameters
from reach.world.rollouts import Outcome, simulate_grasps

PADS_Z = 0.160098
YUMI = ParallelJawGripper.yumi()
RANDOM_TRIALS = 1000 if os.environ.get("REACH_SLOW") == "1" else 60


def box(x: float, y: float, z: float, mass: float) -> GraspObject:
    mesh = trimesh.creation.box((x, y, z))
    return GraspObject("box", mesh.vertices, mesh.faces, mass)


def ball(radius: float, mass: float) -> GraspObject:
    mesh = trimesh.creation.icosphere(2, radius)
    return GraspObject("ball", mesh.vertices, mesh.faces, mass)


def lying(obj: GraspObject) -> np.ndarray:
    return np.array(make_transform(None, (0, 0, -obj.vertices[:, 2].min())))


def from_above(height: float, x: float = 0.0, yaw: float = 0.0) -> np.ndarray:
    """T_world_gripper pointing down, the pads' centers at (x, 0, height), closing along yaw."""
    down = rotation_about((0, 0, 1), yaw) @ np.diag([1.0, -1.0, -1.0])
    return np.array(make_transform(down, (x, 0.0, height + PADS_Z)))


def gripped(
    obj: GraspObject, T_world_gripper: np.ndarray, parameters: WorldParameters, force: float = 20.0
) -> GraspWorld:
    """Close on an object, lift it by 100 mm and wait for 0.3 s."""
    world = GraspWorld(obj, YUMI, lying(obj), T_world_gripper, parameters)
    world.set_jaw_force(force)
    world.advance(0.4)
    for share in np.linspace(0.0, 1.0, 76):
        lifted = T_world_gripper.copy()
        lifted[2, 3] += 0.1 * share * share * (3 - 2 * share)
        world.set_target(lifted)
        world.advance(0.004)
    world.advance(0.3)
    return world


def tilt_of(world: GraspWorld) -> float:
    """Angle of the object's own x axis above the horizontal [rad]."""
    return float(abs(np.arcsin(np.clip(world.T_world_object[2, 0], -1.0, 1.0))))


@pytest.mark.parametrize("timestep", [2e-3, 4e-3])
def test_a_held_bar_of_100_g_creeps_less_than_a_tenth_of_a_millimeter_in_two_seconds(
    timestep: float,
) -> None:
    bar = box(0.12, 0.02, 0.02, 0.1)
    world = gripped(bar, from_above(0.01, yaw=np.pi / 2), WorldParameters(timestep=timestep))
    before = world.T_world_object
    world.advance(2.0)
    moved = np.linalg.norm(world.T_world_object[:3, 3] - before[:3, 3])
    assert world.clearance > 0.09
    assert moved < 1e-4


def test_gravity_torque_above_the_pads_capacity_turns_a_bar_and_below_does_not() -> None:
    bar = box(0.20, 0.02, 0.02, 0.2)
    parameters = WorldParameters(friction=0.4)
    near = gripped(bar, from_above(0.01, x=0.02, yaw=np.pi / 2), parameters)  # 39 N mm
    far = gripped(bar, from_above(0.01, x=0.08, yaw=np.pi / 2), parameters)  # 157 N mm
    assert tilt_of(near) < np.radians(2)
    assert tilt_of(far) > np.radians(15)


def test_a_cube_is_held_by_opposite_edges() -> None:
    cube = box(0.03, 0.03, 0.03, 0.03)
    world = gripped(cube, from_above(0.015, yaw=np.pi / 4), WorldParameters())
    assert world.opening > 0.03  # wider than between faces: the edges are what is held
    assert world.clearance > 0.09
    turned = rotation_angle(world.T_world_object[:3, :3])
    assert turned < np.radians(10)


def test_a_sphere_slips_if_it_is_too_heavy_and_only_then() -> None:
    """Friction carries at most 2 mu F = 8 N at 0.2: half of it is held, twice of it slips."""
    parameters = WorldParameters(friction=0.2)
    light = gripped(ball(0.018, 4.0 / 9.81), from_above(0.018), parameters)
    heavy = gripped(ball(0.018, 16.0 / 9.81), from_above(0.018), parameters)
    assert light.clearance > 0.08
    assert heavy.clearance < 1e-3


def test_each_pad_presses_with_the_closing_force() -> None:
    world = gripped(box(0.03, 0.03, 0.03, 0.03), from_above(0.015), WorldParameters(), force=12.0)
    np.testing.assert_allclose(world.pad_forces, 12.0, rtol=0.02)


def test_the_pads_give_way_by_force_over_stiffness() -> None:
    """A face that covers the pads' middle presses as many springs as it covers area."""
    cube = box(0.03, 0.03, 0.03, 0.03)
    soft = WorldParameters(pad_modulus=0.3e6)
    stiff = WorldParameters(pad_modulus=1.2e6)
    sunk = [0.03 - gripped(cube, from_above(0.015), p).opening for p in (soft, stiff)]
    assert sunk[0] == pytest.approx(4 * sunk[1], rel=0.15)


def test_empty_jaws_rest_where_the_pads_have_given_way_to_each_other() -> None:
    """Two pads in series: by force over half a pad's stiffness, and the force is still felt."""
    parameters = WorldParameters()
    far = np.array(make_transform(None, (0.2, 0, 0))) @ from_above(0.015)
    world = gripped(box(0.03, 0.03, 0.03, 0.01), far, parameters, force=12.0)
    pad = YUMI.jaws[0].pad
    expected = 12.0 / (0.5 * parameters.foundation_modulus * pad.area)
    assert world.opening == pytest.approx(-expected, rel=0.02)
    assert world.empty_opening(12.0) == pytest.approx(-expected)
    np.testing.assert_allclose(world.pad_forces, 12.0, rtol=0.02)


@pytest.mark.parametrize("thickness", [1e-3, 2e-3])
def test_a_thin_part_keeps_the_jaws_apart(thickness: float) -> None:
    """Held by 5 mm of its rim, both pads meet beside it, and still rest wider than on nothing.

    The jaws' force is shared: E / t (A_part (thickness + overlap) / 2 + A overlap / 2) = F.
    """
    parameters = WorldParameters()
    plate = box(thickness, 0.02, 0.04, 0.01)
    rim = 5e-3
    world = gripped(plate, from_above(0.04 - rim + 0.010), parameters)
    covered = 0.012 * rim  # pins within the pad's tip, cut corners left out
    modulus, area = 0.5 * parameters.foundation_modulus, YUMI.jaws[0].pad.area
    overlap = (20.0 / modulus - covered * thickness) / (covered + area)
    assert world.clearance > 0.09
    assert world.opening < 0.0, "the pads meet beside the part"
    assert world.opening - world.empty_opening(20.0) > 1e-4
    assert -world.opening == pytest.approx(overlap, abs=1e-4)
    np.testing.assert_allclose(world.pad_forces, 20.0, rtol=0.02)


def test_energy_stays_bounded_while_a_part_is_held() -> None:
    world = gripped(box(0.03, 0.03, 0.03, 0.03), from_above(0.015, yaw=0.3), WorldParameters())
    energies = []
    for _ in range(50):
        world.advance(0.04)
        energies.append(world.energy)
    assert max(energies) < 1e-5
    assert energies[-1] <= max(energies[:5])


@pytest.mark.slow
def test_random_trials_hold_numbers_only() -> None:
    """Whatever the pose, friction and mass, no state turns into NaN (1,000 with REACH_SLOW=1)."""
    rng = np.random.default_rng(0)
    per_object = RANDOM_TRIALS // 4
    objects = (
        box(0.03, 0.03, 0.03, 0.003),
        box(0.10, 0.01, 0.02, 0.1),
        ball(0.015, 0.02),
        box(0.045, 0.04, 0.004, 0.01),
    )
    for obj in objects:
        T_world_object = lying(obj)
        poses = np.array(
            [
                inverse(T_world_object)
                @ from_above(
                    rng.uniform(0.015, 0.035), rng.uniform(-0.03, 0.03), rng.uniform(-3, 3)
                )
                @ exp(rng.normal(0.0, [0.05] * 3 + [0.004] * 3))
                for _ in range(per_object)
            ]
        )
        outcomes = simulate_grasps(
            Scene(obj, YUMI, T_world_object),
            poses,
            friction=rng.uniform(0.1, 1.5, per_object),
            mass=obj.mass * rng.uniform(0.2, 5.0, per_object),
        )
        assert not np.any(outcomes.outcome == Outcome.DIVERGED)
        assert np.mean(outcomes.outcome != Outcome.COLLISION) > 0.3  # most are really stepped
        for values in (outcomes.clearance, outcomes.opening, outcomes.turned):
            assert np.all(np.isfinite(values))
