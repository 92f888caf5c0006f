from dataclasses import replace

import numpy as np
import pytest

from reach import GraspObject
from reach.symmetry import symmetry
from reach.transforms import exp, make_transform, rotation_about
from registration.grasp_symmetry import same_grasp
from registration.result import Registration, Rival, TableFit

GRASP = exp([0.4, -0.2, 0.9, 0.01, 0.03, -0.02])


def about_center(obj, axis, angle):
    R = rotation_about(axis, angle)
    return make_transform(R, obj.com - R @ obj.com)


@pytest.fixture
def nearly_round():
    """An ellipsoid whose radii are 18, 15.5 and 17 mm."""
    import trimesh

    ball = trimesh.creation.icosphere(4).vertices * np.array([0.018, 0.0155, 0.017])
    return GraspObject("ellipsoid", ball, trimesh.creation.icosphere(4).faces, 0.03)


def registered(T_world_object, rivals) -> Registration:
    return Registration(
        T_camera_object=T_world_object,
        T_world_object=T_world_object,
        covariance=np.eye(6),
        stable_pose=0,
        fitness=1.0,
        rmse=1e-4,
        observed_overlap=1.0,
        model_overlap=1.0,
        free_space_violation=0.0,
        unexplained=0.0,
        render_cost=0.02,
        margin=0.0,
        rivals=tuple(Rival(T, 0, 0.02, 0.0) for T in rivals),
        unobservable=(),
        tilt=0.0,
        table=TableFit(np.array([0.0, 0.0, 1.0]), 0.0, 1e-4, 0.0),
        ambiguous=True,
        contradicts_declared=False,
        seed=0,
    )


def test_a_symmetric_turn_of_a_cube_is_the_same_grasp(parts):
    cube = parts["cube"]
    sym = symmetry(cube)
    quarter = about_center(cube, (0, 0, 1), np.pi / 2)
    slight = exp([0.01, 0.02, 0.0, 5e-4, 0, 0])
    assert same_grasp(sym, GRASP, quarter @ GRASP @ slight, np.radians(5), 2e-3)
    eighth = about_center(cube, (0, 0, 1), np.pi / 4)
    assert not same_grasp(sym, GRASP, eighth @ GRASP, np.radians(5), 2e-3)
    shifted = make_transform(None, (4e-3, 0, 0)) @ GRASP
    assert not same_grasp(sym, GRASP, shifted, np.radians(5), 2e-3)


@pytest.mark.parametrize("angle", [0.1, 1.0, 2.5])
def test_any_turn_about_a_part_of_revolutions_axis_is_the_same_grasp(parts, angle):
    pawn = parts["pawn"]
    sym = symmetry(pawn)
    turned = about_center(pawn, (0, 0, 1), angle) @ GRASP
    assert same_grasp(sym, GRASP, turned, np.radians(5), 2e-3)
    over = about_center(pawn, (1, 0, 0), np.pi) @ GRASP
    assert not same_grasp(sym, GRASP, over, np.radians(5), 2e-3)


def test_only_rivals_with_the_same_grasp_let_a_trial_run_unasked(parts):
    cube = parts["cube"]
    T = exp([0.0, 0.0, 0.7, 0.3, 0.1, 0.0])
    quarter = T @ about_center(cube, (0, 0, 1), np.pi / 2)
    slid = make_transform(None, (0.01, 0, 0)) @ T
    assert registered(T, [quarter]).same_grasp_outcome(cube, GRASP)
    assert not registered(T, [quarter, slid]).same_grasp_outcome(cube, GRASP)
    assert registered(T, []).same_grasp_outcome(cube, GRASP)


def test_a_turned_mug_is_another_grasp(parts):
    mug = parts["mug"]
    T = exp([0.0, 0.0, 0.2, 0.3, 0.1, 0.0])
    turned = T @ make_transform(rotation_about((0, 0, 1), 0.5))
    found = registered(T, [turned])
    assert not found.same_grasp_outcome(mug, GRASP)
    # Grasped from above along the axis, the handle's place does not matter to the tolerances.
    assert found.same_grasp_outcome(mug, GRASP, max_turn=np.pi, max_shift=1.0)


def test_a_turn_that_no_gripper_notices_is_the_same_grasp(nearly_round):
    T = exp([0.0, 0.0, 0.2, 0.3, 0.1, 0.0])
    for angle, noticed in ((0.2, False), (1.2, True)):
        found = registered(T, [T @ about_center(nearly_round, (0, 0, 1), angle)])
        assert found.same_grasp_outcome(nearly_round, GRASP) is not noticed
        assert not found.same_grasp_outcome(nearly_round, GRASP, max_surface=0.0)


def test_what_is_ambiguous_or_contradicts_is_not_accepted():
    found = registered(np.eye(4), [])
    assert not found.accepted
    assert replace(found, ambiguous=False).accepted
    assert not replace(found, ambiguous=False, contradicts_declared=True).accepted
