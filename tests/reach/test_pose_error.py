import numpy as np
import pytest

from reach import PoseError
from reach.transforms import exp

AXIS, CENTER = np.array([0.0, 0.6, 0.8]), np.array([0.02, 0.03, -0.01])
TURN = np.concatenate([AXIS, np.cross(CENTER, AXIS)])
KNOWN = np.diag([1e-6, 2e-6, 3e-6, 1e-8, 2e-8, 3e-8])


def test_a_full_turn_about_an_axis_is_left_out_with_the_way_it_moves_the_origin():
    error = PoseError(KNOWN + np.pi**2 / 3 * np.outer(TURN, TURN))
    told = error.without_free_turns()
    assert told.rotation_deviation < 2e-3
    assert told.translation_deviation < 3e-4  # the turn alone moves the origin by centimeters
    across = np.array([1.0, 0, 0, 0, 0, 0])
    assert across @ told.covariance @ across == pytest.approx(1e-6, rel=0.01)
    for xi in told.sample(np.random.default_rng(0), 20):
        assert np.linalg.norm(exp(xi)[:3, :3] - np.eye(3)) < 0.02


def test_an_error_that_is_known_stays_as_it_is():
    error = PoseError(KNOWN)
    np.testing.assert_allclose(error.without_free_turns().covariance, KNOWN, atol=1e-18)
