"""The same grasp with the hand turned by half a turn: which hands may, and what is executed."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pytest
import trimesh

from collection.errors import RobotError
from collection.plan.records import PlannedGrasp
from collection.record_mapping import execution_record
from collection.robots.half_turn import held_alike, pads_change_places
from collection.robots.motion import can_execute, dry_run, execute_grasp
from collection.station.station import Station, load_station
from reach import AreaContact, Grasp, Scene
from reach.gripper import Jaw, Pad, ParallelJawGripper
from reach.objects import GraspObject
from reach.stable_poses import StablePose
from reach.transforms import inverse, make_transform, rotation_about

YUMI = ParallelJawGripper.yumi()
MESH = trimesh.creation.box((0.03, 0.03, 0.03))
CUBE = GraspObject("cube", MESH.vertices, MESH.faces, 0.01)
RESTING = StablePose(0, 1.0, make_transform(None, (0, 0, 0.015)))
DOWN = make_transform(np.diag([1.0, -1.0, -1.0]), (0, 0, 0.160098))
SLANTED = np.array(
    make_transform(rotation_about((1, 0, 0), 0.6), (0, 0, 0.005)) @ DOWN
)  # a grasp that the arm does not reach however the part is turned


def with_second_jaw(jaw: Jaw) -> ParallelJawGripper:
    return replace(YUMI, jaws=(YUMI.jaws[0], jaw))


def test_half_a_turn_of_the_yumi_s_hand_puts_each_pad_where_the_other_was() -> None:
    T = make_transform(rotation_about((1, 1, 0), 2.0), (0.3, -0.1, 0.2))
    planned, turned = held_alike(YUMI, T)
    np.testing.assert_array_equal(planned, T)
    for mine, other in ((0, 1), (1, 0)):
        np.testing.assert_allclose(
            turned @ YUMI.T_gripper_pad(mine, 0.02), T @ YUMI.T_gripper_pad(other, 0.02), atol=1e-12
        )
    assert turned[:3, 2] == pytest.approx(T[:3, 2])  # the approach is the same


def test_a_hand_whose_pads_differ_is_not_turned() -> None:
    jaw = YUMI.jaws[1]
    shorter = Pad(jaw.pad.polygon * (0.9, 1.0))
    lower = np.array(jaw.T_gripper_pad_open) @ make_transform(None, (0.002, 0, 0))
    for other in (replace(jaw, pad=shorter), replace(jaw, T_gripper_pad_open=lower)):
        hand = with_second_jaw(other)
        assert not pads_change_places(hand)
        assert held_alike(hand, DOWN).shape == (1, 4, 4)


def test_a_pad_s_corners_may_be_listed_from_another_one() -> None:
    jaw = YUMI.jaws[1]
    rolled = Pad(np.roll(jaw.pad.polygon, 2, axis=0))
    assert pads_change_places(with_second_jaw(replace(jaw, pad=rolled)))


def test_the_contact_model_cannot_tell_the_two_apart() -> None:
    scene = Scene(CUBE, YUMI, RESTING.T_world_object)
    aside = inverse(scene.T_world_object) @ make_transform(None, (0, 0.009, 0.018)) @ DOWN
    planned, turned = (
        AreaContact().evaluate(scene, Grasp(T)) for T in held_alike(YUMI, np.array(aside))
    )
    assert planned.resists == turned.resists
    assert planned.margin == pytest.approx(turned.margin, abs=1e-6)
    areas = [[patch.area for patch in each.patches] for each in (planned, turned)]
    assert areas[0] == pytest.approx(areas[1][::-1])


@pytest.fixture
def station() -> Iterator[Station]:
    with load_station("simulated", seed=4) as each:
        yield each


def placed_out_of_reach(station: Station) -> np.ndarray:
    """Put the cube where only the turned hand reaches the slanted grasp; that grasp (4, 4)."""
    simulation = station.simulation
    assert simulation is not None
    simulation.place(CUBE, RESTING, np.random.default_rng(22))
    return np.array(simulation.true_T_world_object() @ SLANTED)


def test_a_grasp_out_of_reach_is_executed_half_a_turn_on(station: Station) -> None:
    T_world_gripper = placed_out_of_reach(station)
    with pytest.raises(RobotError):
        dry_run(station.arm, T_world_gripper)
    alike = held_alike(YUMI, T_world_gripper)
    execution = execute_grasp(station.arm, station.gripper, alike, station.clock)
    np.testing.assert_array_equal(execution.T_world_gripper_planned, alike[1])
    np.testing.assert_allclose(execution.T_world_gripper, alike[1], atol=4e-3)
    assert station.simulation is not None
    assert station.simulation.verdict().lifted

    T_world_object = T_world_gripper @ inverse(SLANTED)
    grasp = PlannedGrasp.model_construct(T_object_gripper=SLANTED)
    record = execution_record(execution, T_world_object, grasp, {})
    assert record.details["half_turn"] == "true"
    np.testing.assert_allclose(
        record.executed.T_object_gripper, held_alike(YUMI, SLANTED)[1], atol=4e-3
    )


def test_a_grasp_in_reach_is_executed_as_planned(station: Station) -> None:
    assert station.simulation is not None
    station.simulation.place(CUBE, RESTING, np.random.default_rng(0))
    T_world_object = station.simulation.true_T_world_object()
    alike = held_alike(YUMI, T_world_object @ DOWN)
    assert can_execute(station.arm, alike[0])
    np.testing.assert_array_equal(dry_run(station.arm, alike), alike[0])


def test_the_first_reason_is_told_when_no_way_round_is_free(station: Station) -> None:
    alike = held_alike(YUMI, make_transform(None, (1.0, 0, 0)) @ DOWN)
    assert not can_execute(station.arm, alike)
    with pytest.raises(RobotError, match="avoidance"):
        dry_run(station.arm, alike)
