"""A pose that the image does not tell must be right by proof, or told to be open."""

import numpy as np
import pytest

from benchmarks.registration_holdout import holdout_part
from reach.symmetry import pose_distance, symmetry
from registration import register


@pytest.mark.parametrize("mode", ["declared", "free"])
def test_a_turn_that_noise_hides_is_never_accepted(scenes, mode):
    obj = holdout_part("near_sphere", 1)
    rng = np.random.default_rng([1, 5])
    case = scenes.make_case(obj, rng, scenes.SceneSettings("stereo"), stable_pose=0)
    found = register(obj, case.frame, stable_pose=0, mode=mode)
    assert found.ambiguous and not found.accepted
    # The poses that the operator is shown, or that must all take the same grasp, are others.
    turns = [
        pose_distance(symmetry(obj), found.T_world_object, rival.T_world_object)[0]
        for rival in found.rivals
        if not rival.ruled_out
    ]
    assert turns and max(turns) > np.radians(5)


@pytest.mark.parametrize("kind", ["round_superellipsoid", "eccentric_disc"])
def test_a_turn_that_noise_nearly_hides_is_right_or_asked_about(scenes, is_right, kind):
    obj = holdout_part(kind, 1)
    accepted = 0
    for seed in (5, 6, 7):
        rng = np.random.default_rng([1, seed])
        case = scenes.make_case(obj, rng, scenes.SceneSettings("stereo"), stable_pose=0)
        found = register(obj, case.frame, stable_pose=0)
        assert not found.accepted or is_right(case, found.T_camera_object)
        accepted += found.accepted
    assert accepted > 0


@pytest.mark.parametrize("kind", ["near_sphere", "round_superellipsoid"])
def test_a_fine_camera_tells_how_a_nearly_round_part_is_turned(scenes, is_right, kind):
    obj = holdout_part(kind, 1)
    case = scenes.make_case(obj, np.random.default_rng([1, 5]), scenes.SceneSettings())
    found = register(obj, case.frame, stable_pose=case.stable_pose)
    assert found.accepted and is_right(case, found.T_camera_object)
    assert all(rival.log_odds > 0 for rival in found.rivals)


def test_a_slot_that_is_out_of_sight_leaves_the_turn_open(scenes):
    obj = holdout_part("notched_nut", 1)
    flat = 2
    ambiguous = 0
    for seed in range(4):
        rng = np.random.default_rng(seed)
        case = scenes.make_case(obj, rng, scenes.SceneSettings("stereo"), stable_pose=flat)
        found = register(obj, case.frame, stable_pose=flat)
        apart = pose_distance(symmetry(obj), found.T_camera_object, case.T_camera_object)[0]
        assert found.ambiguous or apart < np.radians(5)
        ambiguous += found.ambiguous
    assert ambiguous > 0
