"""The slow comparison: it undoes shared errors, and poses are at their best before it."""

from dataclasses import replace

import numpy as np
import pytest

from benchmarks.registration_holdout import holdout_part
from benchmarks.registration_objects import part
from reach.symmetry import pose_distance, symmetry
from reach.transforms import exp, make_transform, rotation_about
from registration.correlation import REACH
from registration.job import Job
from registration.options import RegistrationOptions
from registration.whitening import ErrorModel


def _correlation(width: float) -> np.ndarray:
    lags = np.arange(-REACH, REACH + 1)
    apart2 = lags[:, None] ** 2 + lags[None, :] ** 2
    return 0.8 * np.exp(-apart2 / width**2) + 0.2 * (apart2 == 0)


def test_undoing_shared_errors_inverts_their_covariance():
    rng = np.random.default_rng(0)
    known = rng.random((30, 40)) > 0.1
    own = np.where(rng.random((30, 40)) > 0.8, 16.0, 0.25)
    errors = ErrorModel(_correlation(3.0), 1, variance=1.0, own=own, known=known)
    images = np.where(known, rng.normal(size=(3, 30, 40)), 0.0)
    np.testing.assert_allclose(errors.times(errors.undone(images, 200)), images, atol=1e-6)


def test_the_covariance_is_that_of_every_pair_of_pixels():
    correlation = _correlation(3.0)
    shape, pixel = (9, 11), (4, 5)
    errors = ErrorModel(
        correlation, 1, variance=2.0, own=np.full(shape, 0.5), known=np.ones(shape, bool)
    )
    alone = np.zeros(shape)
    alone[pixel] = 1.0
    v, u = np.indices(shape)
    expected = 2.0 * correlation[REACH + v - pixel[0], REACH + u - pixel[1]] + 0.5 * alone
    np.testing.assert_allclose(errors.times(alone), expected, atol=1e-9)


@pytest.fixture(scope="module")
def gear(scenes):
    """A keyed gear before a stereo camera, and a close look at it."""
    obj = part("keyed_gear")
    case = scenes.make_case(obj, np.random.default_rng(3), scenes.SceneSettings("stereo"), 0)
    job = Job(obj, case.frame, RegistrationOptions(), 0)
    return case, job, job.close_look(job.groups[0])


def test_alignment_comes_nearer_to_the_truth(gear):
    case, job, look = gear
    up = case.T_camera_object[:3, :3].T @ job.table.normal_camera
    along = np.cross(up, [0.6, 0.8, 0.3])
    errors = []
    for way in (1, -1):
        turn = way * np.radians(1.5) * up
        start = case.T_camera_object @ exp(
            np.concatenate([turn, np.cross(job.obj.com, turn) + 1e-3 * way * along])
        )
        aligned = look.aligned(start)
        errors.append(
            [pose_distance(symmetry(job.obj), T, case.T_camera_object) for T in (start, aligned)]
        )
    before, after = np.sum(errors, axis=0)
    assert after[0] < 0.7 * before[0]
    assert after[1] < 0.5 * before[1]


def test_sliding_does_not_turn(gear):
    case, _, look = gear
    slid = look.aligned(case.T_camera_object, turning=False)
    np.testing.assert_allclose(slid[:3, :3], case.T_camera_object[:3, :3], atol=1e-12)


def test_odds_change_sign_with_the_order(gear):
    case, job, look = gear
    turn = make_transform(rotation_about((0, 0, 1), np.radians(45)))
    true, other = case.T_camera_object, case.T_camera_object @ turn
    share, odds = look.weigh(true, other)
    back_share, back_odds = look.weigh(other, true)
    assert share > 0.5
    assert odds > 20
    assert back_share == pytest.approx(-share)
    assert back_odds == pytest.approx(-odds)
    assert look.weigh(true, true) == (0.0, 0.0)


def test_a_slot_narrower_than_the_errors_patches_is_seen(scenes):
    """The quick comparison cannot tell; the close one can, and is right."""
    obj = holdout_part("slotted_cylinder", 102)
    closer = 0
    for seed in range(3):
        case = scenes.make_case(obj, np.random.default_rng(seed), scenes.SceneSettings("stereo"))
        job = Job(obj, case.frame, RegistrationOptions(), seed)
        hypothesis = job.on_table([job.poses[case.stable_pose]], "search")[0]
        true = replace(hypothesis, T_camera_object=case.T_camera_object)
        turn = rotation_about((0, 0, 1), np.radians(120))  # about the cylinder's axis
        T = case.T_camera_object @ make_transform(turn, obj.com - turn @ obj.com)
        quick = job.weigh(true, [replace(true, T_camera_object=T)]).log_odds[0]
        share, odds = job.close_look(hypothesis.search).weigh(case.T_camera_object, T)
        assert share > -0.2
        closer += odds > quick
    assert closer >= 2
