"""Is the covariance honest? 90 % of true errors must lie within the 90 % ellipsoid."""

import os

import numpy as np
import pytest
from scipy import stats

from reach.symmetry import symmetry
from reach.transforms import inverse, log
from registration import register
from registration.polish import PRINT_ERROR, SHARED_ERROR, _systematic

FULL = os.environ.get("REACH_SLOW") == "1"
NAMES = ("bar_clamp", "bracket", "chiral_stair", "near_symmetric_box", "pipe_tee", "cube")


def squared_distance(obj, found, case) -> float:
    """Mahalanobis distance of the true pose from the estimate, up to the part's symmetry."""
    information = np.linalg.inv(found.covariance)
    errors = [
        log(inverse(found.T_camera_object) @ case.T_camera_object @ S)
        for S in symmetry(obj).transforms()
    ]
    return min(float(xi @ information @ xi) for xi in errors)


@pytest.mark.slow
@pytest.mark.parametrize("sensor", ["structured-light", "stereo"])
def test_ninety_percent_of_errors_lie_within_the_ninety_percent_ellipsoid(parts, scenes, sensor):
    distances = []
    for i, name in enumerate(NAMES):
        for k in range(25 if FULL else 3):
            rng = np.random.default_rng([91, i, k])
            case = scenes.make_case(parts[name], rng, scenes.SceneSettings(sensor))
            found = register(case.obj, case.frame, stable_pose=case.stable_pose)
            if found.accepted:
                distances.append(squared_distance(case.obj, found, case))
    inside = np.mean(np.array(distances) < stats.chi2.ppf(0.9, 6))
    # With a few trials the share scatters: three standard deviations of the binomial count.
    slack = 0.0 if FULL else 3 * np.sqrt(0.1 * 0.9 / len(distances))
    assert 0.80 - slack <= inside <= 0.97 + slack


def test_noisier_images_are_known_less_well(parts, scenes):
    spread = []
    for noise in (1.0, 2.5):
        settings = scenes.SceneSettings("structured-light", noise=noise)
        case = scenes.make_case(parts["bracket"], np.random.default_rng(5), settings)
        found = register(case.obj, case.frame, stable_pose=case.stable_pose)
        spread.append(np.trace(found.covariance[:3, :3]))
    assert spread[1] > 1.5 * spread[0]


def test_the_shared_error_lies_along_the_view():
    T = np.eye(4)
    points = np.array([[0.0, 0.0, 0.5], [0.0, 0.0, 0.6]])
    covariance = _systematic(T, points)
    assert covariance[5, 5] == pytest.approx(SHARED_ERROR**2 + PRINT_ERROR**2)
    assert covariance[3, 3] == covariance[4, 4] == pytest.approx(PRINT_ERROR**2)
    assert np.all(covariance[:3] == 0)
