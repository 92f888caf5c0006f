"""Parameters are found again where labels depend on them, and not where they do not."""

import numpy as np
import pytest
import trimesh

from reach.errors import InvalidInputError
from reach.evaluation.cases import GraspCase
from reach.evaluation.fit import (
    ROTATION_PER_TRANSLATION,
    fit_parameters,
    grid_of,
    log_likelihood,
)
from reach.grasp import Grasp
from reach.gripper import ParallelJawGripper
from reach.models.registry import make_scorer
from reach.objects import GraspObject
from reach.pose_error import PoseError
from reach.scene import Scene
from reach.transforms import make_transform, rotation_about

YUMI = ParallelJawGripper.yumi()
SAMPLES = 25
GRID = {
    "friction": (0.15, 0.4, 1.0),
    "compliance": (1e-4, 2e-4),
    "translation": (5e-4, 2e-3, 8e-3),
}


@pytest.fixture(autouse=True)
def own_cache(tmp_path, monkeypatch):
    monkeypatch.setattr("reach.evaluation.score_cache.cache_folder", lambda: tmp_path / "cache")


def labeled(mass, friction, translation, *, grasps=40, trials=10, yaw=0.25):
    """Grasps near a bar's end, labeled by the model itself with given parameters."""
    rng = np.random.default_rng(5)
    mesh = trimesh.creation.box((0.03, 0.08, 0.03))
    part = GraspObject("bar", mesh.vertices, mesh.faces, mass=mass)
    scene = Scene(part, YUMI, make_transform(None, (0.4, 0, 0.015)))
    scorer = make_scorer("reach-robust", samples=400, friction=friction)
    error = PoseError.isotropic(
        translation=translation, rotation=ROTATION_PER_TRANSLATION * translation
    )
    height = float(YUMI.T_gripper_pad(0)[2, 3])
    cases = []
    for number in range(grasps):
        turn = rotation_about((0, 0, 1), rng.uniform(-yaw, yaw))
        rotation = turn @ rotation_about((1, 0, 0), np.pi)
        offset = np.array([0.0, rng.uniform(0, 0.05), rng.uniform(0.0, 0.02)])
        grasp = Grasp(make_transform(rotation, offset - rotation @ (0, 0, height)))
        q = scorer.score(scene, grasp, pose_error=error, seed=11).value
        cases.append(
            GraspCase("bar", f"g{number}", scene, grasp, int(rng.binomial(trials, q)), trials)
        )
    return cases


def test_friction_and_pose_error_are_found_for_a_heavy_bar():
    cases = labeled(mass=0.4, friction=0.4, translation=2e-3)
    assert 0 < sum(case.successes for case in cases) < sum(case.trials for case in cases)
    found = fit_parameters(cases, make_scorer, samples=SAMPLES, grid=GRID)
    friction, error = found.parameters["friction"], found.parameters["translation"]
    assert friction.low <= 0.4 <= friction.high
    assert friction.told and friction.bounded_below
    assert error.low <= 2e-3 <= error.high
    assert error.told


def test_friction_on_a_light_part_cannot_be_told():
    """Jaws nearly parallel to its faces: with 20 N any friction holds 3 g."""
    cases = labeled(mass=0.003, friction=0.4, translation=2e-3, yaw=0.02)
    found = fit_parameters(cases, make_scorer, samples=SAMPLES, grid=GRID)
    friction = found.parameters["friction"]
    assert not friction.told
    assert friction.to_json()["best"] is None
    assert (friction.low, friction.high) == (0.15, 1.0)


@pytest.mark.parametrize("model", ["reach-robust", "settled-robust"])
def test_every_grid_names_parameters_that_its_model_has(model):
    values = {name: each[0] for name, each in grid_of(model).items() if name != "translation"}
    scorer = make_scorer(model, samples=1, **values)
    assert {name: scorer.parameters[name] for name in values} == values


def test_a_settled_model_is_fitted_for_its_pads_stiffness():
    cases = labeled(mass=0.003, friction=0.4, translation=5e-4, yaw=0.02, grasps=8)
    grid = {"friction": (0.4,), "stiffness": (7.5e7, 3e8), "translation": (5e-4,)}
    found = fit_parameters(cases, make_scorer, model="settled-robust", samples=5, grid=grid)
    stiffness = found.parameters["stiffness"]
    assert stiffness.best in grid["stiffness"]
    assert stiffness.profile[stiffness.best] == 0.0 >= min(stiffness.profile.values())


def test_likelihood_by_hand():
    (case,) = labeled(mass=0.4, friction=0.4, translation=2e-3, grasps=1)
    case = GraspCase("bar", "g", case.scene, case.grasp, 3, 5)
    p = (0.6 * 25 + 0.5) / 26
    expected = 3 * np.log(p) + 2 * np.log(1 - p)
    assert log_likelihood([case], np.array([0.6]), 25) == pytest.approx(expected)
    assert np.isfinite(log_likelihood([case], np.array([0.0]), 25))


def test_too_few_grasps_are_refused():
    with pytest.raises(InvalidInputError, match="2 labeled grasps cannot tell"):
        fit_parameters(
            labeled(mass=0.4, friction=0.4, translation=2e-3, grasps=2), make_scorer, grid=GRID
        )
