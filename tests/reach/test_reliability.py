"""Reliability: distribution, seeds, intervals, the adaptive mode; and the pose error it draws from."""

import numpy as np
import pytest
import trimesh
from scipy.stats import binomtest

from reach import (
    AreaContact,
    Grasp,
    GraspObject,
    ParallelJawGripper,
    PointContact,
    PoseError,
    Scene,
    reliability,
    transforms,
)
from reach.errors import InvalidInputError
from reach.models.reference import ReferenceAreaContact
from reach.robustness import draw_samples, wilson_interval


def near_the_edge(y=0.014):
    """A cube held near its rim, so that some perturbations lose it."""
    mesh = trimesh.creation.box((0.03, 0.03, 0.03))
    part = GraspObject("cube", mesh.vertices, mesh.faces, 0.5)
    grasp = Grasp(transforms.make_transform(None, (0, y, -0.160)))
    return Scene(part, ParallelJawGripper.yumi(), np.eye(4)), grasp


def test_without_error_reliability_is_the_verdict():
    scene, grasp = near_the_edge()
    none = PoseError(np.zeros((6, 6)))
    q = reliability(
        AreaContact(), scene, grasp, pose_error=none, samples=5, friction_spread=0, mass_spread=0
    )
    verdict = AreaContact().evaluate(scene, grasp)
    assert q.value == float(verdict.resists)
    assert q.mean_margin == pytest.approx(verdict.margin)
    assert q.counts[str(verdict.reason)] == q.samples == 5


def test_seeded_and_between_the_bounds():
    scene, grasp = near_the_edge()
    error = PoseError.isotropic(translation=0.004, rotation=0.02)
    first = reliability(AreaContact(), scene, grasp, pose_error=error, samples=200, seed=3)
    again = reliability(AreaContact(), scene, grasp, pose_error=error, samples=200, seed=3)
    other = reliability(AreaContact(), scene, grasp, pose_error=error, samples=200, seed=4)
    assert first == again
    assert first.mean_margin != other.mean_margin
    assert 0 < first.low < first.value < first.high < 1
    assert sum(first.counts.values()) == 200


def test_worse_poses_are_less_reliable():
    scene, grasp = near_the_edge(y=0.018)
    values = [
        reliability(
            AreaContact(),
            scene,
            grasp,
            pose_error=PoseError.isotropic(translation=t, rotation=0.0),
            samples=300,
        ).value
        for t in (0.0005, 0.004, 0.012)
    ]
    assert values[0] > values[1] > values[2]


def test_adaptive_mode_stops_when_sure_and_sees_the_same_samples():
    scene, grasp = near_the_edge(y=0.0)
    error = PoseError.isotropic(translation=0.0005, rotation=0.001)
    sure = reliability(AreaContact(), scene, grasp, pose_error=error, samples=2000, adaptive=0.15)
    assert sure.high - sure.low < 0.15
    assert sure.samples < 100
    prefix = reliability(AreaContact(), scene, grasp, pose_error=error, samples=sure.samples)
    assert (prefix.value, prefix.counts) == (sure.value, sure.counts)
    scene, grasp = near_the_edge()
    error = PoseError.isotropic(translation=0.004, rotation=0.02)
    unsure = reliability(AreaContact(), scene, grasp, pose_error=error, samples=100, adaptive=0.01)
    assert unsure.samples == 100


@pytest.mark.parametrize(("successes", "trials"), [(0, 10), (3, 10), (50, 100), (10, 10)])
def test_wilson_interval_agrees_with_scipy(successes, trials):
    expected = binomtest(successes, trials).proportion_ci(0.95, method="wilson")
    np.testing.assert_allclose(wilson_interval(successes, trials), expected, atol=1e-12)


def test_samples_follow_the_stated_distribution():
    scene, grasp = near_the_edge()
    rng = np.random.default_rng(0)
    root = rng.normal(size=(6, 6)) * 0.003
    error = PoseError(root @ root.T)
    T, friction, mass = draw_samples(scene, grasp, error, 20000, 0, 0.1, 0.05)
    # T_true_gripper = exp(-xi) T_believed_gripper: recover xi.
    xi = np.array(
        [-transforms.log(pose @ transforms.inverse(grasp.T_object_gripper)) for pose in T[:4000]]
    )
    np.testing.assert_allclose(np.cov(xi.T), error.covariance, atol=0.08 * error.covariance.max())
    assert friction.mean() == pytest.approx(1, abs=0.005)
    assert friction.std() == pytest.approx(0.1, rel=0.03)
    assert mass.mean() == pytest.approx(0.5, rel=0.005)
    assert mass.std() == pytest.approx(0.025, rel=0.03)


def test_a_trials_own_covariance_matters_by_direction():
    """An error along the pads' width loses the rim; the same error along the closing axis does not."""
    scene, grasp = near_the_edge(y=0.018)
    across, along = np.zeros((6, 6)), np.zeros((6, 6))
    across[4, 4] = along[3, 3] = 0.006**2
    q_across, q_along = (
        reliability(AreaContact(), scene, grasp, pose_error=PoseError(covariance), samples=200)
        for covariance in (across, along)
    )
    assert q_along.value > q_across.value + 0.1


def off_the_middle(opening):
    """A thin plate 8 mm beside the middle: a hand opened by 10 mm comes down with a jaw inside it."""
    mesh = trimesh.creation.box((0.008, 0.03, 0.03))
    part = GraspObject("plate", mesh.vertices, mesh.faces, 0.02)
    grasp = Grasp(transforms.make_transform(None, (-0.012, 0, -0.160)), opening)
    return Scene(part, ParallelJawGripper.yumi(), np.eye(4)), grasp


@pytest.mark.parametrize("model", [AreaContact(), PointContact(), ReferenceAreaContact()])
def test_the_opening_decides_where_the_jaws_start(model):
    error = PoseError(np.zeros((6, 6)))
    for opening, holds in ((None, True), (0.05, True), (0.01, False)):
        scene, grasp = off_the_middle(opening)
        alone = model.evaluate(scene, grasp)
        batch = model.evaluate_batch(scene, grasp.T_object_gripper[None], opening=opening)
        q = reliability(model, scene, grasp, pose_error=error, samples=2)
        assert alone.resists is holds
        assert bool(batch.resists[0]) is holds
        assert q.value == float(holds)


def test_an_opening_beyond_the_grippers_is_refused():
    scene, grasp = off_the_middle(0.06)
    with pytest.raises(InvalidInputError, match=r"opening 0.06 m .* outside 0 to 0.05"):
        AreaContact().evaluate(scene, grasp)
    with pytest.raises(InvalidInputError, match=r"opening 0.06 m .* outside 0 to 0.05"):
        AreaContact().evaluate_batch(scene, grasp.T_object_gripper[None], opening=0.06)


def test_bad_arguments():
    scene, grasp = near_the_edge()
    error = PoseError.isotropic(translation=0.001, rotation=0.01)
    with pytest.raises(InvalidInputError, match="samples is 0"):
        reliability(AreaContact(), scene, grasp, pose_error=error, samples=0)
    with pytest.raises(InvalidInputError, match="samples is 1.5"):
        reliability(AreaContact(), scene, grasp, pose_error=error, samples=1.5)
    with pytest.raises(InvalidInputError, match="seed is -1"):
        reliability(AreaContact(), scene, grasp, pose_error=error, seed=-1)
    with pytest.raises(InvalidInputError, match="friction_spread"):
        reliability(AreaContact(), scene, grasp, pose_error=error, friction_spread=-1)
    with pytest.raises(InvalidInputError, match="adaptive"):
        reliability(AreaContact(), scene, grasp, pose_error=error, adaptive=0.0)
    with pytest.raises(InvalidInputError, match="not symmetric"):
        PoseError(np.triu(np.ones((6, 6))))
    with pytest.raises(InvalidInputError, match="negative eigenvalue"):
        PoseError(-np.eye(6))
    with pytest.raises(InvalidInputError, match="translation error"):
        PoseError.isotropic(translation=-1, rotation=0)


def test_pose_errors_add_and_perturb_on_the_right():
    a = PoseError.isotropic(translation=0.003, rotation=0.0)
    b = PoseError.isotropic(translation=0.004, rotation=0.01)
    assert (a + b).translation_deviation == pytest.approx(0.005)
    assert (a + b).rotation_deviation == pytest.approx(0.01)
    assert a + b == b + a and hash(a + b) == hash(b + a)
    T = transforms.exp(np.array([0.3, -1.2, 0.5, 0.1, 0.2, 0.3]))
    only_x = np.zeros((6, 6))
    only_x[3, 3] = 1e-4
    moved = PoseError(only_x).perturb(T, np.random.default_rng(0), 50)
    offsets = (moved[:, :3, 3] - T[:3, 3]) @ T[:3, :3]
    np.testing.assert_allclose(offsets[:, 1:], 0, atol=1e-12)  # along the object's own x
    assert offsets[:, 0].std() > 0
