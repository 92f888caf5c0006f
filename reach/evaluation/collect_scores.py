"""Scores of many grasps as they come: looked up, computed on several cores, kept, and counted."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from reach.arrays import FloatArray
from reach.errors import UnknownNameError
from reach.evaluation.cases import GraspCase
from reach.evaluation.score_cache import ScoreCache, grasp_digest
from reach.grasp import Grasp
from reach.scene import Scene

BACKENDS = ("serial", "threading", "loky", "dask")

Progress = Callable[[int, int], None]
"""Called with the number of grasps done and their total."""
ScoreGrasp = Callable[[Scene, Grasp], Sequence[float]]
"""Gives a grasp its scores; travels to worker processes by pickling."""
Answer = tuple[int, tuple[float, ...], float]
"""Index of a grasp, its scores, and the wall time they took [s]."""


@dataclass(frozen=True, slots=True)
class Workers:
    """Where scores are computed.

    Args:
        backend: serial, threading, loky (processes) or dask (an existing cluster: make its
            `distributed.Client` the current one before).
        jobs: number of workers of threading and loky; all cores if -1.

    Raises:
        UnknownNameError: no such backend.
    """

    backend: str = "serial"
    jobs: int = -1

    def __post_init__(self) -> None:
        if self.backend not in BACKENDS:
            raise UnknownNameError("scoring backend", self.backend, BACKENDS)


def collect_scores(
    cases: Sequence[GraspCase],
    score: ScoreGrasp,
    width: int,
    workers: Workers,
    cache: ScoreCache | None,
    progress: Progress | None,
) -> tuple[FloatArray, list[float]]:
    """Score every grasp that the cache does not know.

    Each score is kept as it arrives: a run that is killed or interrupted goes on where it stopped.

    Args:
        cases: N grasps.
        score: gives a grasp its scores.
        width: number of scores a grasp.
        workers: where it is done.
        cache: of exactly these scores; None keeps nothing.
        progress: called as scores arrive.

    Returns:
        Scores (N, width), and the wall time of each grasp scored now [s].
    """
    digests = [grasp_digest(case.scene, case.grasp) for case in cases]
    known = [cache.get(digest) if cache else None for digest in digests]
    values = np.array([(np.nan,) * width if one is None else one for one in known])
    missing = [i for i, one in enumerate(known) if one is None]
    done, seconds = len(cases) - len(missing), []
    if progress:
        progress(done, len(cases))
    for i, scores, elapsed in _answers(score, [(i, cases[i]) for i in missing], workers):
        values[i] = scores
        seconds.append(elapsed)
        if cache:
            cache.put(digests[i], scores)
        done += 1
        if progress:
            progress(done, len(cases))
    return values, seconds


def timed(score: ScoreGrasp, index: int, scene: Scene, grasp: Grasp) -> Answer:
    """Score one grasp, and measure the wall time."""
    start = time.perf_counter()
    scores = tuple(float(value) for value in score(scene, grasp))
    return index, scores, time.perf_counter() - start


def _answers(
    score: ScoreGrasp, tasks: Sequence[tuple[int, GraspCase]], workers: Workers
) -> Iterator[Answer]:
    """Yield answers as they come, in any order."""
    if workers.backend == "serial" or len(tasks) < 2:
        for i, case in tasks:
            yield timed(score, i, case.scene, case.grasp)
        return
    import joblib

    jobs = {} if workers.backend == "dask" else {"n_jobs": workers.jobs}
    with joblib.parallel_config(backend=workers.backend, **jobs):
        parallel = joblib.Parallel(return_as="generator_unordered", batch_size=1)
        yield from parallel(
            joblib.delayed(timed)(score, i, case.scene, case.grasp) for i, case in tasks
        )
