"""Scores of a model on labeled grasps, and of a model under many parameter sets."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import partial
from typing import TYPE_CHECKING, Protocol

import numpy as np

from reach.arrays import FloatArray
from reach.cache import cache_key
from reach.evaluation.cases import GraspCase
from reach.evaluation.collect_scores import (
    Progress,
    ScoreGrasp,
    Workers,
    collect_scores,
    timed,
)
from reach.evaluation.score_cache import ScoreCache
from reach.evaluation.scored import Parameter, ScoredModel, used_parameters
from reach.grasp import Grasp
from reach.scene import Scene
from reach.sources import source_digest

if TYPE_CHECKING:
    from reach.pose_error import PoseError

TIMED_AGAIN = 5
"""Grasps scored once more, one after the other, where this run's times would mislead."""


class Score(Protocol):
    """What a scorer answers."""

    @property
    def value(self) -> float:
        """Reliability in [0, 1]."""


class Scorer(Protocol):
    """A model that gives a grasp a score; see [reach.models.registry][]."""

    @property
    def name(self) -> str: ...  # noqa: D102
    @property
    def version(self) -> str: ...  # noqa: D102
    @property
    def parameters(self) -> Mapping[str, Parameter]: ...  # noqa: D102

    def score(  # noqa: D102
        self, scene: Scene, grasp: Grasp, *, pose_error: PoseError | None, seed: int
    ) -> Score: ...


def score_cases(
    cases: Sequence[GraspCase],
    scorer: Scorer,
    *,
    pose_error: PoseError | None,
    seed: int = 0,
    backend: str = "serial",
    jobs: int = -1,
    progress: Progress | None = None,
    use_cache: bool = True,
) -> ScoredModel:
    """Score every grasp by one model.

    A grasp's score depends on its own content and the seed alone, not on the other grasps,
    their order, the backend or the number of processes: any way of running gives the same.

    Args:
        cases: N labeled grasps.
        scorer: the model; it travels to worker processes by pickling.
        pose_error: the station's, in the object's frame.
        seed: of the perturbations.
        backend: see [Workers][reach.evaluation.collect_scores.Workers].
        jobs: number of workers.
        progress: called as scores arrive.
        use_cache: False scores everything anew, and keeps nothing.

    Raises:
        UnknownNameError: no such backend.
    """
    workers = Workers(backend, jobs)
    cache = ScoreCache(_model_key([scorer], pose_error, seed)) if use_cache else None
    score = partial(_score, scorer, pose_error, seed)
    values, seconds = collect_scores(cases, score, 1, workers, cache, progress)
    if not seconds or backend != "serial":
        seconds = _seconds_alone(cases, score)
    parameters = used_parameters(scorer.parameters, pose_error)
    return ScoredModel(
        scorer.name, scorer.version, parameters, values[:, 0], float(np.median(seconds))
    )


def score_draws(
    cases: Sequence[GraspCase],
    scorers: Sequence[Scorer],
    *,
    pose_error: PoseError | None,
    seed: int = 0,
    backend: str = "serial",
    jobs: int = -1,
    progress: Progress | None = None,
) -> FloatArray:
    """Score every grasp by one model under several sets of its parameters.

    The scores are those of [score_cases][]; the analytic models share between the sets what does
    not depend on them. Kept as they arrive, grasp by grasp.

    Args:
        cases: N labeled grasps.
        scorers: the model with each of D parameter sets.
        pose_error: the station's, in the object's frame.
        seed: of the perturbations.
        backend: see [Workers][reach.evaluation.collect_scores.Workers].
        jobs: number of workers.
        progress: called as grasps are done.

    Returns:
        Shape (D, N).

    Raises:
        UnknownNameError: no such backend.
    """
    workers = Workers(backend, jobs)
    cache = ScoreCache(_model_key(scorers, pose_error, seed), len(scorers))
    score = partial(_score_draws, tuple(scorers), pose_error, seed)
    return collect_scores(cases, score, len(scorers), workers, cache, progress)[0].T


def _score(
    scorer: Scorer, pose_error: PoseError | None, seed: int, scene: Scene, grasp: Grasp
) -> tuple[float]:
    return (float(scorer.score(scene, grasp, pose_error=pose_error, seed=seed).value),)


def _score_draws(
    scorers: Sequence[Scorer], pose_error: PoseError | None, seed: int, scene: Scene, grasp: Grasp
) -> Sequence[float]:
    from reach.models.draws import scores_of_draws, share_work

    if share_work(scorers):
        return list(scores_of_draws(scorers, scene, grasp, pose_error=pose_error, seed=seed))
    return [_score(one, pose_error, seed, scene, grasp)[0] for one in scorers]


def _seconds_alone(cases: Sequence[GraspCase], score: ScoreGrasp) -> list[float]:
    """Times of a few grasps from all over the list, with nothing else running in this process.

    Each is scored twice and the quicker time taken: what is prepared once for a part is no cost
    of a grasp.
    """
    places = np.linspace(0, len(cases) - 1, min(TIMED_AGAIN, len(cases))).astype(int)
    some = [(int(i), cases[i].scene, cases[i].grasp) for i in places]
    return [min(timed(score, *one)[2] for _ in range(2)) for one in some]


def _model_key(scorers: Sequence[Scorer], pose_error: PoseError | None, seed: int) -> str:
    """Digest of all a list of scores depends on besides the grasps, the code itself included."""
    covariance = None if pose_error is None else pose_error.covariance.tobytes()
    models = [(one.name, one.version, sorted(one.parameters.items())) for one in scorers]
    return cache_key(models, source_digest(), covariance, seed)
