"""The paper's cross-validation of several models at once, with intervals and gains."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from reach.evaluation.bootstrap import Interval, bootstrap, intervals
from reach.evaluation.cross_validation import (
    DRAWS,
    CrossValidation,
    MakeScorer,
    Progress,
    cross_validate,
    draw_parameters,
    drawable,
    label_of,
    variants,
)
from reach.evaluation.gains import PAIRS, Gain, gains
from reach.evaluation.table import Evaluation

if TYPE_CHECKING:
    from reach.pose_error import PoseError


@dataclass(frozen=True, slots=True, eq=False)
class Protocol:
    """Held-out results of all models that have parameters to draw.

    Args:
        draws: number of parameter sets.
        seed: of the parameters, perturbations and bootstrap.
        rows: one a model and treatment of the depth.
        intervals: metric -> 95 % bootstrap interval, in the rows' order.
        gains: of REACH over the point model, with and without saturation.
        exempt: models whose parameters are not drawn.
    """

    draws: int
    seed: int
    rows: tuple[CrossValidation, ...]
    intervals: tuple[dict[str, Interval], ...]
    gains: tuple[Gain, ...]
    exempt: tuple[str, ...]

    def to_json(self) -> dict[str, Any]:
        """The result as plain JSON values; a model with a depth has two rows."""
        models: dict[str, list[dict[str, Any]]] = {}
        for row, bounds in zip(self.rows, self.intervals, strict=True):
            content = row.to_json()
            content["intervals"] = {key: value and list(value) for key, value in bounds.items()}
            models.setdefault(row.model, []).append(content)
        return {
            "draws": self.draws,
            "seed": self.seed,
            "models": models,
            "gains": [gain.to_json() for gain in self.gains],
            "exempt": list(self.exempt),
        }


def run_protocol(
    result: Evaluation,
    make: MakeScorer,
    names: Sequence[str],
    *,
    pose_error: PoseError | None,
    draws: int = DRAWS,
    seed: int = 0,
    backend: str = "serial",
    jobs: int = -1,
    progress: Progress | None = None,
) -> Protocol:
    """Leave one object out, for each of the models.

    Args:
        result: the labeled grasps.
        make: makes a scorer by name and parameters.
        names: of the models.
        pose_error: the station's.
        draws: number of parameter sets.
        seed: of the parameters, perturbations and bootstrap.
        backend: see [score_cases][reach.evaluation.scoring.score_cases].
        jobs: number of workers.
        progress: called with a row's name, the number of grasps done, and their total.

    Raises:
        InvalidInputError: fewer than two objects with a success.
    """
    parameters = draw_parameters(seed, draws)
    drawn = [name for name in names if drawable(make, name)]
    rows = tuple(
        cross_validate(
            result.cases,
            make,
            name,
            parameters,
            saturated=saturated,
            pose_error=pose_error,
            seed=seed,
            backend=backend,
            jobs=jobs,
            progress=progress,
        )
        for name in drawn
        for saturated in variants(make, name)
    )
    labels = [label_of(row.model, row.saturated) for row in rows]
    scores = {label: row.scores for label, row in zip(labels, rows, strict=True)}
    resampled = bootstrap(result.outcomes, scores, np.random.default_rng(seed))
    means = {label: row.mean for label, row in zip(labels, rows, strict=True)}
    pairs = [
        (label_of(model, saturated), label_of(rival, None))
        for saturated in (True, False)
        for model, rival in PAIRS
    ]
    return Protocol(
        draws,
        seed,
        rows,
        tuple(intervals(result.outcomes, resampled[label]) for label in labels),
        gains(result.outcomes, means, resampled, pairs),
        tuple(name for name in names if name not in drawn),
    )
