"""About an axis of symmetry nothing is told, whatever facets and noise seem to say."""

import numpy as np
import pytest

from reach.symmetry import Symmetry, symmetry
from reach.transforms import exp
from registration import register
from registration.free_turns import told_directions
from registration.polish import UNKNOWN_TURN

COM = np.array([0.01, 0.02, -0.03])
AXIS = np.array([0.0, 0.6, 0.8])


def about(axis, angle):
    return np.concatenate([angle * axis, np.cross(COM, angle * axis)])


def test_a_turn_about_the_axis_is_taken_out_and_nothing_else():
    told = told_directions(Symmetry(np.eye(3)[None], AXIS, COM))
    np.testing.assert_allclose(told @ about(AXIS, 0.7), 0.0, atol=1e-12)
    np.testing.assert_allclose(told @ told, told, atol=1e-12)
    for other in ([1.0, 0.0, 0.0], [0.0, -0.8, 0.6]):
        turn = about(np.array(other), 0.7)
        np.testing.assert_allclose(told @ turn, turn, atol=1e-12)
    slide = np.array([0, 0, 0, 1.0, 2.0, 3.0])
    np.testing.assert_allclose(told @ slide, slide, atol=1e-12)


def test_a_sphere_leaves_all_turns_and_a_box_none():
    sphere = told_directions(Symmetry(np.eye(3)[None], None, COM, sphere=True))
    for axis in np.eye(3):
        np.testing.assert_allclose(sphere @ about(axis, 0.3), 0.0, atol=1e-12)
    np.testing.assert_array_equal(told_directions(Symmetry(np.eye(3)[None], None, COM)), np.eye(6))


@pytest.mark.parametrize("sensor", ["structured-light", "stereo"])
def test_how_a_round_part_is_turned_is_not_claimed(parts, scenes, sensor):
    pawn = parts["pawn"]
    sym = symmetry(pawn)
    case = scenes.make_case(pawn, np.random.default_rng(4), scenes.SceneSettings(sensor))
    found = register(pawn, case.frame, stable_pose=case.stable_pose)
    assert found.accepted
    assert found.unobservable[0] == "rotation about the object's z"
    variance, direction = np.linalg.eigh(found.covariance)
    assert np.sqrt(variance[-1]) == pytest.approx(UNKNOWN_TURN, rel=0.01)
    turn = np.concatenate([sym.axis, np.cross(sym.center, sym.axis)])
    assert abs(direction[:, -1] @ turn) / np.linalg.norm(turn) == pytest.approx(1.0, abs=1e-6)
    # All else is known well: any turn of the part within the covariance is the same surface.
    assert np.sqrt(variance[-2]) < np.radians(3)
    turned = found.T_camera_object @ exp(turn * 1.3)
    np.testing.assert_allclose(
        turned[:3, :3] @ pawn.com + turned[:3, 3],
        found.T_camera_object[:3, :3] @ pawn.com + found.T_camera_object[:3, 3],
        atol=1e-12,
    )
