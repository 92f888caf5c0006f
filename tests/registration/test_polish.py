"""How many independent depths, of what noise, at what slant, tell a pose."""

import numpy as np
import pytest

from reach.transforms import inverse, log
from registration import register
from registration.polish import RIM, SLOPES, _effective, _rim_share, _spread


def test_a_subset_is_worth_less_the_closer_its_points_lie():
    assert _effective(1500, 12_000, 1.0) == pytest.approx(1500)
    assert _effective(1500, 1500, 5.0) == pytest.approx(300)  # all points: total over area
    assert _effective(1500, 1_500_000, 5.0) == pytest.approx(1500, rel=0.01)  # far apart
    assert _effective(1500, 6000, 5.0) == pytest.approx(1200)


def test_depths_of_slanted_faces_are_known_as_well_as_they_scatter():
    rng = np.random.default_rng(0)
    cosine = rng.uniform(0.2, 1.0, 6000)
    true = np.where(cosine < SLOPES[1], 3e-4, 1e-4)
    sigma = _spread(true * rng.normal(size=6000), np.ones(6000), cosine, noise=1e-4)
    np.testing.assert_allclose(sigma, true, rtol=0.1)
    # A few lucky points do not make a face known better than those seen more squarely.
    lucky = _spread(np.where(cosine < 0.5, 1e-6, 1e-4), np.ones(6000), cosine, noise=1e-4)
    assert lucky.min() > 0.9e-4


def test_the_rim_tells_no_more_than_its_shared_error_lets_it():
    gain = np.full(1000, 1e8)
    cosine = np.where(np.arange(1000) < 500, 0.9 * RIM, 0.9)
    share = _rim_share(gain, cosine, 1e-4)
    assert np.all(share[500:] == 1.0)
    assert (gain * share)[:500].sum() == pytest.approx(1e8, rel=0.01)
    few = _rim_share(np.full(1000, 1.0), cosine, 1e-4)
    np.testing.assert_allclose(few, 1.0, rtol=1e-4)


@pytest.mark.parametrize("name", ["near_symmetric_box", "chiral_stair", "cube"])
def test_a_box_of_which_two_faces_are_seen_is_not_claimed_along_their_edge(parts, scenes, name):
    for seed in range(2):
        case = scenes.make_case(parts[name], np.random.default_rng(seed), scenes.SceneSettings())
        found = register(case.obj, case.frame, stable_pose=case.stable_pose)
        if name == "cube":  # whose symmetric copies are right as well: its center tells
            center = np.append(parts[name].com, 1.0)
            error = (inverse(found.T_camera_object) @ case.T_camera_object @ center - center)[:3]
        else:
            error = log(inverse(found.T_camera_object) @ case.T_camera_object)[3:]
        assert np.all(np.abs(error) < 4 * np.sqrt(np.diag(found.covariance)[3:]) + 2e-5)
