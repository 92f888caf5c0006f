"""Scoring many grasps by one model: in parallel, cached by content, with progress."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np

from reach.cache import cache_key
from reach.errors import UnknownNameError
from reach.evaluation.cases import GraspCase
from reach.evaluation.score_cache import ScoreCache, grasp_digest
from reach.evaluation.scored import Parameter, ScoredModel, used_parameters
from reach.grasp import Grasp
from reach.scene import Scene
from reach.sources import source_digest

if TYPE_CHECKING:
    from reach.pose_error import PoseError

BACKENDS = ("serial", "threading", "loky", "dask")
TIMED_AGAIN = 5
"""Grasps scored once more, one after the other, where this run's times would mislead."""

Progress = Callable[[int, int], None]
"""Called with the number of grasps done and their total."""


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
        backend: serial, threading, loky (processes) or dask (an existing cluster: make its
            `distributed.Client` the current one before).
        jobs: number of workers of threading and loky; all cores if -1.
        progress: called as scores arrive.
        use_cache: False scores everything anew, and keeps nothing.

    Raises:
        UnknownNameError: no such backend.
    """
    if backend not in BACKENDS:
        raise UnknownNameError("scoring backend", backend, BACKENDS)
    cache = ScoreCache(_model_key(scorer, pose_error, seed)) if use_cache else None
    digests = [grasp_digest(case.scene, case.grasp) for case in cases]
    known = [cache.get(digest) if cache else None for digest in digests]
    values = np.array([np.nan if value is None else value for value in known])
    missing = [i for i, value in enumerate(known) if value is None]
    done, seconds = len(cases) - len(missing), []
    if progress:
        progress(done, len(cases))
    tasks = [(i, cases[i].scene, cases[i].grasp) for i in missing]
    for i, value, elapsed in _run(scorer, tasks, pose_error, seed, backend, jobs):
        values[i] = value
        seconds.append(elapsed)
        if cache:
            cache.put(digests[i], value)
        done += 1
        if progress:
            progress(done, len(cases))
    if not seconds or backend != "serial":
        seconds = _seconds_alone(cases, scorer, pose_error, seed)
    parameters = used_parameters(scorer.parameters, pose_error)
    return ScoredModel(scorer.name, scorer.version, parameters, values, float(np.median(seconds)))


def _seconds_alone(
    cases: Sequence[GraspCase], scorer: Scorer, pose_error: PoseError | None, seed: int
) -> list[float]:
    """Times of a few grasps from all over the list, with nothing else running in this process.

    Each is scored twice and the quicker time taken: what is prepared once for a part is no cost
    of a grasp.
    """
    places = np.linspace(0, len(cases) - 1, min(TIMED_AGAIN, len(cases))).astype(int)
    some = [(int(i), cases[i].scene, cases[i].grasp) for i in places]
    return [min(_score_one(scorer, task, pose_error, seed)[2] for _ in range(2)) for task in some]


def _model_key(scorer: Scorer, pose_error: PoseError | None, seed: int) -> str:
    """Digest of all a list of scores depends on besides the grasps, the code itself included."""
    covariance = None if pose_error is None else pose_error.covariance.tobytes()
    parameters = sorted(scorer.parameters.items())
    code = source_digest()
    return cache_key(scorer.name, scorer.version, code, parameters, covariance, seed)


Task = tuple[int, Scene, Grasp]
Answer = tuple[int, float, float]


def _score_one(scorer: Scorer, task: Task, pose_error: PoseError | None, seed: int) -> Answer:
    """Score one grasp: its index, the score, and the wall time [s]."""
    index, scene, grasp = task
    start = time.perf_counter()
    value = scorer.score(scene, grasp, pose_error=pose_error, seed=seed).value
    return index, float(value), time.perf_counter() - start


def _run(
    scorer: Scorer,
    tasks: Sequence[Task],
    pose_error: PoseError | None,
    seed: int,
    backend: str,
    jobs: int,
) -> Any:
    """Yield answers as they come, in any order."""
    if backend == "serial" or len(tasks) < 2:
        for task in tasks:
            yield _score_one(scorer, task, pose_error, seed)
        return
    import joblib

    with joblib.parallel_config(backend=backend, **({} if backend == "dask" else {"n_jobs": jobs})):
        parallel = joblib.Parallel(return_as="generator_unordered", batch_size=1)
        yield from parallel(
            joblib.delayed(_score_one)(scorer, task, pose_error, seed) for task in tasks
        )
