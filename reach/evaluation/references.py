"""The three rows every comparison needs, scores that use no contact model.

A model that does not beat `constant` says nothing, one that does not beat `overlap` has no use
for its physics, and none can beat `oracle`, which knows each grasp's success rate.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

import numpy as np

from reach.arrays import FloatArray
from reach.evaluation.cases import GraspCase
from reach.evaluation.overlap import overlap_score
from reach.evaluation.scored import ScoredModel

if TYPE_CHECKING:
    from reach.pose_error import PoseError

REFERENCE_NAMES = ("constant", "overlap", "oracle")


def reference_rows(
    cases: Sequence[GraspCase],
    *,
    pose_error: PoseError | None,
    samples: int = 30,
    seed: int = 0,
    progress: Callable[[int, int], None] | None = None,
) -> list[ScoredModel]:
    """Score all cases by the constant 1, the pads' overlap with the object, and the true rate.

    Args:
        cases: N labeled grasps.
        pose_error: what the overlap is averaged under; the planned pose alone if None.
        samples: number of perturbed poses the overlap is averaged over.
        seed: of the perturbations.
        progress: called with the number of grasps whose overlap is known, and their total.
    """
    count = len(cases)
    overlap = np.empty(count)
    start = time.perf_counter()
    for i, case in enumerate(cases):
        overlap[i] = overlap_score(
            case.scene, case.grasp, pose_error=pose_error, samples=samples, seed=seed
        )
        if progress:
            progress(i + 1, count)
    seconds = (time.perf_counter() - start) / count
    rates: FloatArray = np.array([case.rate for case in cases])
    parameters: dict[str, float | bool | str] = {"samples": samples if pose_error else 1}
    return [
        ScoredModel("constant", "1", {"value": 1.0}, np.ones(count), 0.0),
        ScoredModel("overlap", "1", parameters, overlap, seconds),
        ScoredModel("oracle", "1", {}, rates, 0.0),
    ]
