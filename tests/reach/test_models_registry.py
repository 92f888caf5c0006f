"""Scorers by name: values, records, and the rivals side by side."""

import json

import numpy as np
import pytest
import trimesh

from reach import Grasp, GraspObject, ParallelJawGripper, PoseError, Scene, transforms
from reach.errors import InvalidInputError, UnknownNameError
from reach.models import registry
from reach.models.names import ANALYTIC_NAMES, MODEL_NAMES
from reach.models.registry import make_scorer

NAMES = ("reach", "reach-robust", "point", "point-robust", "ellipse", "ellipse-robust")


@pytest.fixture(scope="module")
def scene():
    mesh = trimesh.creation.box((0.03, 0.03, 0.03))
    part = GraspObject("cube", mesh.vertices, mesh.faces, 0.05)
    return Scene(part, ParallelJawGripper.yumi(), np.eye(4))


def grasps():
    return [
        Grasp(transforms.make_transform(None, (0, y, -0.160))) for y in (0.0, 0.012, 0.018, 0.1)
    ]


def test_names():
    assert set(NAMES) < set(MODEL_NAMES)
    assert "dynamic" not in ANALYTIC_NAMES
    with pytest.raises(UnknownNameError, match="unknown model 'best'; valid: .*reach-robust"):
        make_scorer("best")
    with pytest.raises(InvalidInputError, match="'point' does not take .*compliance"):
        make_scorer("point", compliance=1e-4)


@pytest.mark.parametrize("name", NAMES)
def test_scores_are_chances_and_can_be_stored(scene, name):
    scorer = make_scorer(name, friction=0.5)
    assert scorer.name == name
    assert scorer.version
    assert scorer.parameters["friction"] == 0.5
    one_by_one = [scorer.score(scene, grasp, seed=1) for grasp in grasps()]
    seen = []
    together = scorer.score_many(scene, grasps(), seed=1, progress=seen.append)
    assert seen[-1] == len(grasps())
    assert [score.value for score in together] == [score.value for score in one_by_one]
    assert all(0 <= score.value <= 1 and score.seconds > 0 for score in together)
    assert together[0].value == 1 and together[-1].value == 0
    json.dumps([score.details for score in together] + [scorer.parameters])
    assert scorer.score_many(scene, []) == []


def test_robust_scorers_take_the_trials_own_error(scene):
    scorer = make_scorer("reach-robust", samples=200, pose_translation=1e-5, pose_rotation=1e-5)
    grasp = grasps()[1]
    sure = scorer.score(scene, grasp)
    wild = scorer.score(scene, grasp, pose_error=PoseError.isotropic(translation=0.01, rotation=0))
    assert sure.value == 1 > wild.value
    assert wild.details["pose_translation"] == pytest.approx(0.01)
    assert wild.details["low"] <= wild.value <= wild.details["high"]


def test_the_opening_of_a_grasp_is_heeded(scene):
    """A jaw that starts nearer cannot meet what lies behind its pad."""
    free, narrow = grasps()[0], Grasp(grasps()[0].T_object_gripper, opening=0.01)
    scores = make_scorer("reach").score_many(scene, [free, narrow])
    assert [score.value for score in scores] == [1.0, 0.0]


def test_a_model_whose_module_is_missing_is_refused_by_name(monkeypatch):
    monkeypatch.setitem(registry._FACTORIES, "settled", "reach.models.gone:make_gone")
    with pytest.raises(
        InvalidInputError, match="model 'settled' cannot be used .*reach.models.gone"
    ):
        make_scorer("settled")
