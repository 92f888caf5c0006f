import numpy as np
import pytest

from reach.transforms import exp
from registration.unobservable import CONFIDENCE, STEPS, open_ways

COM = np.array([0.02, -0.01, 0.03])
T = exp([0.3, -0.8, 0.5, 0.2, -0.1, 0.6])
TURN, SHIFT = np.radians(5.0), 2e-3


def about_com(turns, shifts):
    """Covariance (6, 6) about the object's origin of independent errors about the center of mass."""
    M = np.eye(6)
    M[3:, :3] = [[0, -COM[2], COM[1]], [COM[2], 0, -COM[0]], [-COM[1], COM[0], 0]]
    return M @ np.diag(np.square([*turns, *shifts])) @ M.T


def test_a_pose_that_is_known_has_no_open_ways():
    known = about_com([TURN / 3] * 3, [SHIFT / 3] * 3)
    assert open_ways(T, known, COM, TURN, SHIFT) == ()


def test_an_open_turn_has_two_ways_about_the_center_of_mass():
    ways = open_ways(T, about_com([1e-3, TURN, 1e-3], [1e-4] * 3), COM, TURN, SHIFT)
    assert len(ways) == 2
    for way in ways:
        angles = []
        for pose in way.poses:
            between = np.linalg.inv(T) @ pose
            np.testing.assert_allclose(between[:3, :3] @ COM + between[:3, 3], COM, atol=1e-9)
            np.testing.assert_allclose(between[:3, 1], (0, 1, 0), atol=1e-9)
            angles.append(np.arctan2(between[0, 2], between[0, 0]))
        # From what is known well enough to where the error may well be.
        assert np.abs(angles) == pytest.approx([TURN, 1.5 * TURN, 2 * TURN, CONFIDENCE * TURN])
        assert len(set(np.sign(angles))) == 1
    assert (np.linalg.inv(T) @ ways[0].poses[0])[0, 2] * (np.linalg.inv(T) @ ways[1].poses[0])[
        0, 2
    ] < 0


def test_an_open_slide_moves_the_center_of_mass_but_not_without_end():
    ways = open_ways(T, about_com([1e-3] * 3, [1e-4, 1e-4, 1.0]), COM, TURN, SHIFT)
    assert len(ways) == 2
    for way in ways:
        between = np.linalg.inv(T) @ way.poses
        np.testing.assert_allclose(
            between[:, :3, :3], np.broadcast_to(np.eye(3), (4, 3, 3)), atol=1e-6
        )
        assert np.abs(between[:, 2, 3]) == pytest.approx(SHIFT * np.array(STEPS), rel=1e-3)
