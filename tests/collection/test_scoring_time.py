"""The computing time beside a recorded score is a grasp's: nothing that is done once is in it."""

from dataclasses import dataclass, field

import numpy as np
import pytest
import trimesh

from collection.scoring import predictions as scoring
from reach import AreaContact, Grasp, GraspObject, ParallelJawGripper, PoseError, Scene, transforms
from reach.contact import Verdict
from reach.models.registry import Score, make_scorer, warm_up

COMPILING, SCORING = 60.0, 0.01


@pytest.fixture(scope="module")
def scene():
    mesh = trimesh.creation.box((0.03, 0.03, 0.03))
    part = GraspObject("cube", mesh.vertices, mesh.faces, 0.05)
    return Scene(part, ParallelJawGripper.yumi(), np.eye(4))


GRASP = Grasp(transforms.make_transform(None, (0, 0, -0.160)))


class SlowAtFirst(AreaContact):
    """A contact model whose first verdict takes a minute of compiling, by its own account."""

    taken: list = []  # noqa: RUF012

    def evaluate(self, scene, grasp) -> Verdict:
        self.taken.append(SCORING if self.taken else COMPILING)
        return super().evaluate(scene, grasp)


@dataclass
class Scorer:
    name: str = "slow at first"
    version: str = "1"
    parameters: dict = field(default_factory=dict)
    model: SlowAtFirst = field(default_factory=SlowAtFirst)

    def score(self, scene, grasp, *, pose_error=None, seed=0):
        verdict = self.model.evaluate(scene, grasp)
        return Score(float(verdict.resists), self.model.taken[-1])


def test_the_first_score_of_a_session_holds_no_compile_time(scene, monkeypatch):
    scorer = Scorer()
    monkeypatch.setattr(scoring, "make_scorer", lambda name: scorer)
    error = PoseError.isotropic(translation=1e-3, rotation=1e-2)
    prediction = scoring._predict("point", scene, GRASP, error, 0)
    assert prediction.score.seconds == SCORING
    assert scorer.model.taken == [COMPILING, SCORING]


@pytest.mark.parametrize("name", ["reach", "reach-robust", "settled", "settled-robust"])
def test_every_scorer_of_a_contact_model_is_warmed_up(scene, name, monkeypatch):
    scorer = make_scorer(name)
    asked = []
    judge = type(scorer.model).evaluate
    monkeypatch.setattr(
        type(scorer.model), "evaluate", lambda *given: asked.append(given) or judge(*given)
    )
    warm_up(scorer, scene, GRASP)
    assert len(asked) == 1
