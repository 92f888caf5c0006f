"""Score grasps by several models and the references, and tabulate: one call."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING

from reach.evaluation.cases import GraspCase
from reach.evaluation.references import OverlapScorer, constant_row, oracle_row
from reach.evaluation.scoring import Scorer, score_cases
from reach.evaluation.table import Evaluation, tabulate

if TYPE_CHECKING:
    from reach.pose_error import PoseError

Progress = Callable[[str, int, int], None]
"""Called with a model's name, the number of grasps done, and their total."""


def compare(
    cases: Sequence[GraspCase],
    scorers: Sequence[Scorer],
    *,
    pose_error: PoseError | None,
    seed: int = 0,
    backend: str = "serial",
    jobs: int = -1,
    progress: Progress | None = None,
    use_cache: bool = True,
) -> Evaluation:
    """Evaluate models on labeled grasps, beside the three reference rows.

    Args:
        cases: labeled grasps.
        scorers: the models.
        pose_error: the station's, in the object's frame.
        seed: of perturbations and bootstrap.
        backend: see [score_cases][reach.evaluation.scoring.score_cases].
        jobs: number of workers.
        progress: called as scores arrive.
        use_cache: False scores everything anew.
    """

    def report(name: str) -> Callable[[int, int], None] | None:
        return None if progress is None else lambda done, total: progress(name, done, total)

    rows = {
        scorer.name: score_cases(
            cases,
            scorer,
            pose_error=pose_error,
            seed=seed,
            backend=backend,
            jobs=jobs,
            progress=report(scorer.name),
            use_cache=use_cache,
        )
        for scorer in (*scorers, OverlapScorer())
    }
    overlap = rows.pop("overlap")
    scored = [*rows.values(), constant_row(cases), overlap, oracle_row(cases)]
    return tabulate(cases, scored, seed=seed)


def scorers_of(
    names: Sequence[str], overrides: Mapping[str, Mapping[str, float | bool | str]] | None = None
) -> list[Scorer]:
    """Make the named models' scorers.

    Args:
        names: of [MODEL_NAMES][reach.models.registry.MODEL_NAMES].
        overrides: parameters by model that replace the defaults.

    Raises:
        UnknownNameError: no such model.
    """
    from reach.models.registry import make_scorer

    return [make_scorer(name, **dict((overrides or {}).get(name, {}))) for name in names]
