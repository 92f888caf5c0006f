"""What the image says for one pose against another: odds that noise and feature size explain."""

from dataclasses import replace

import numpy as np
import pytest

from reach.stable_poses import stable_poses
from reach.transforms import make_transform, rotation_about
from registration import RegistrationOptions
from registration.decision import ENOUGH
from registration.evidence import Weigher
from registration.job import Job


def weighed(case, poses, noise=None, bias=3e-5):
    job = Job(case.obj, case.frame, RegistrationOptions(), seed=0)
    search = job.groups[0]
    weigher = Weigher(
        job.model,
        search.seen,
        tolerance=search.fine_tolerance,
        noise=noise or search.depth_noise,
        bias=bias,
    )
    return weigher.weigh(poses[0], np.stack(poses[1:]))


@pytest.fixture(scope="module")
def gear(parts, scenes):
    """Images of a gear lying flat, its keyway up, and the pose a tooth further."""
    keyed = parts["keyed_gear"]
    flat = next(p.index for p in stable_poses(keyed) if p.T_world_object[2, 2] > 0.99)
    cases = {
        sensor: scenes.make_case(
            keyed, np.random.default_rng(2), scenes.SceneSettings(sensor), stable_pose=flat
        )
        for sensor in scenes.CAMERAS
    }
    tooth = make_transform(rotation_about((0, 0, 1), np.radians(30)))
    return cases, tooth


def test_a_keyway_tells_a_fine_camera_and_not_a_coarse_one(gear):
    cases, tooth = gear
    odds = {
        sensor: weighed(case, [case.T_camera_object, case.T_camera_object @ tooth]).log_odds[0]
        for sensor, case in cases.items()
    }
    assert odds["structured-light"] > 2 * ENOUGH
    assert odds["stereo"] < ENOUGH


def test_evidence_for_one_pose_is_evidence_against_the_other(gear):
    cases, tooth = gear
    case = cases["structured-light"]
    true, turned = case.T_camera_object, case.T_camera_object @ tooth
    forth, back = weighed(case, [true, turned]), weighed(case, [turned, true])
    assert back.log_odds[0] == pytest.approx(-forth.log_odds[0], rel=0.05)
    assert back.margin[0] == pytest.approx(-forth.margin[0], abs=0.02)


def test_noise_and_shared_bias_weaken_evidence(gear):
    cases, tooth = gear
    case = cases["structured-light"]
    poses = [case.T_camera_object, case.T_camera_object @ tooth]
    odds = [
        weighed(case, poses, noise=1e-4).log_odds[0],
        weighed(case, poses, noise=3e-4).log_odds[0],
        weighed(case, poses, noise=3e-4, bias=1e-3).log_odds[0],
    ]
    assert odds[0] > odds[1] > odds[2] > 0


def test_pixels_without_a_return_say_nothing(gear):
    cases, tooth = gear
    case = cases["structured-light"]
    poses = [case.T_camera_object, case.T_camera_object @ tooth]
    depth = np.array(case.frame.depth)
    # Blind the camera to all but every third row: less evidence, of the same sign.
    depth[np.arange(len(depth)) % 3 > 0] = np.nan
    blinded = replace(case, frame=replace(case.frame, depth=depth))
    full, part = weighed(case, poses), weighed(blinded, poses)
    assert 0 < part.log_odds[0] < full.log_odds[0]
