import numpy as np
import pytest

from reach.transforms import exp
from registration.unobservable import CONFIDENCE, FAR, open_ends

COM = np.array([0.02, -0.01, 0.03])
T = exp([0.3, -0.8, 0.5, 0.2, -0.1, 0.6])
TURN, SHIFT = np.radians(5.0), 2e-3


def about_com(turns, shifts):
    """Covariance (6, 6) about the object's origin of independent errors about the center of mass."""
    M = np.eye(6)
    M[3:, :3] = [[0, -COM[2], COM[1]], [COM[2], 0, -COM[0]], [-COM[1], COM[0], 0]]
    return M @ np.diag(np.square([*turns, *shifts])) @ M.T


def test_a_pose_that_is_known_has_no_open_ends():
    known = about_com([TURN / 3] * 3, [SHIFT / 3] * 3)
    assert open_ends(T, known, COM, TURN, SHIFT).shape == (0, 4, 4)


def test_an_open_turn_has_two_ends_about_the_center_of_mass():
    ends = open_ends(T, about_com([1e-3, TURN / 2, 1e-3], [1e-4] * 3), COM, TURN, SHIFT)
    assert len(ends) == 2
    for end in ends:
        between = np.linalg.inv(T) @ end
        np.testing.assert_allclose(between[:3, :3] @ COM + between[:3, 3], COM, atol=1e-9)
        np.testing.assert_allclose(between[:3, 1], (0, 1, 0), atol=1e-9)
        angle = np.arctan2(between[0, 2], between[0, 0])
        assert abs(angle) == pytest.approx(CONFIDENCE * TURN / 2, rel=1e-6)
    assert np.sign(np.linalg.inv(T) @ ends[0])[0, 2] == -np.sign(np.linalg.inv(T) @ ends[1])[0, 2]


def test_an_open_slide_moves_the_center_of_mass_but_not_without_end():
    ends = open_ends(T, about_com([1e-3] * 3, [1e-4, 1e-4, 1.0]), COM, TURN, SHIFT)
    assert len(ends) == 2
    moved = [np.linalg.inv(T) @ end for end in ends]
    for between in moved:
        np.testing.assert_allclose(between[:3, :3], np.eye(3), atol=1e-6)
        assert abs(between[2, 3]) == pytest.approx(FAR * SHIFT, rel=1e-3)
