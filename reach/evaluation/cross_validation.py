"""The paper's protocol: leave one object out, choose parameters on the others.

[Danielczuk2019] Sect. 5.4: parameters are drawn from wide ranges; for each object, the draw with
the best mean average precision on all other objects is applied to it. Compliance is drawn up to
0.01 m/N: times 20 N deeper than any pad, so that the paper's depth does not saturate. Both are
computed, with and without saturation at the pad's limit.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from reach.arrays import FloatArray
from reach.errors import InvalidInputError
from reach.evaluation.bootstrap import OBJECT_METRICS
from reach.evaluation.cases import GraspCase, Outcomes
from reach.evaluation.scored import Parameter
from reach.evaluation.scoring import Scorer, score_draws
from reach.evaluation.table import mean_metrics, object_metrics

if TYPE_CHECKING:
    from reach.pose_error import PoseError

DRAWS = 100
RANGES: Mapping[str, tuple[float, float]] = {
    "friction": (0.3, 1.5),
    "torsion": (0.01, 1.0),
    "compliance": (1e-4, 1e-2),
}
"""Uniform ranges of the paper: mu, gamma (soft point contact), kappa [m/N]."""

DRAWN = ("friction", "torsion", "compliance")
MakeScorer = Callable[..., Scorer]
Progress = Callable[[str, int, int], None]


@dataclass(frozen=True, slots=True, eq=False)
class HeldOut:
    """What was chosen for an object that no choice has seen.

    Args:
        draw: index of the chosen draw.
        parameters: that draw.
        training_ap: mean average precision of the draw on the other objects.
        metrics: of the draw on this object.
    """

    draw: int
    parameters: Mapping[str, float]
    training_ap: float
    metrics: Mapping[str, float | None]


@dataclass(frozen=True, slots=True, eq=False)
class CrossValidation:
    """Leave-one-object-out result of one model.

    Args:
        model: its name.
        saturated: whether the depth was limited by the pad; None if the model has no depth.
        mean: averages over the held-out objects.
        objects: what was chosen for each.
        scores: the held-out scores of all grasps, shape (N,).
    """

    model: str
    saturated: bool | None
    mean: Mapping[str, float | None]
    objects: Mapping[str, HeldOut]
    scores: FloatArray

    def to_json(self) -> dict[str, Any]:
        """The result as plain JSON values."""
        return {
            **self.mean,
            "saturated": self.saturated,
            "objects": {
                name: {
                    "draw": held.draw,
                    "parameters": dict(held.parameters),
                    "training_ap": held.training_ap,
                    **held.metrics,
                }
                for name, held in self.objects.items()
            },
        }


def draw_parameters(seed: int, count: int = DRAWS) -> list[dict[str, float]]:
    """Parameter sets from the paper's ranges, the same for every model."""
    rng = np.random.default_rng(seed)
    return [{name: float(rng.uniform(*RANGES[name])) for name in DRAWN} for _ in range(count)]


def variants(make: MakeScorer, name: str) -> list[bool | None]:
    """With and without saturation for a model that has a depth, else one variant."""
    return [True, False] if "saturate" in make(name).parameters else [None]


def drawable(make: MakeScorer, name: str) -> bool:
    """Whether the paper's ranges are about this model's parameters."""
    return (
        name != "dynamic"
        and not name.startswith("settled")
        and bool(set(DRAWN) & set(make(name).parameters))
    )


def label_of(model: str, saturated: bool | None) -> str:
    """Name of a row: the model, and how its depth was treated where it has one."""
    depth = {True: ", saturated", False: ", unsaturated", None: ""}[saturated]
    return model + depth


def cross_validate(
    cases: Sequence[GraspCase],
    make: MakeScorer,
    name: str,
    draws: Sequence[Mapping[str, float]],
    *,
    saturated: bool | None,
    pose_error: PoseError | None,
    seed: int = 0,
    backend: str = "serial",
    jobs: int = -1,
    progress: Progress | None = None,
) -> CrossValidation:
    """Leave one object out: score all draws, choose on the others, judge on the one.

    Scores are cached as they arrive: an interrupted run goes on where it stopped.

    Args:
        cases: labeled grasps of at least two objects.
        make: makes a scorer by name and parameters.
        name: of the model.
        draws: parameter sets.
        saturated: limit the depth by the pad; None leaves it to the model.
        pose_error: the station's.
        seed: of the perturbations.
        backend: see [score_cases][reach.evaluation.scoring.score_cases].
        jobs: number of workers.
        progress: called with the row's name, the number of grasps done, and their total.

    Raises:
        InvalidInputError: fewer than two objects with a success.
    """
    outcomes = Outcomes.of(cases)
    if len(outcomes.objects) - len(outcomes.without_positive) < 2:
        raise InvalidInputError(
            "cross-validation leaves one object out: it needs at least two objects with a "
            f"success, there are {len(outcomes.objects) - len(outcomes.without_positive)}"
        )
    known = set(make(name).parameters)
    used = [{k: v for k, v in draw.items() if k in known} for draw in draws]
    treatment: dict[str, Parameter] = {} if saturated is None else {"saturate": saturated}
    all_scores = score_draws(
        cases,
        [make(name, **draw, **treatment) for draw in used],
        pose_error=pose_error,
        seed=seed,
        backend=backend,
        jobs=jobs,
        progress=None if progress is None else partial(progress, label_of(name, saturated)),
    )
    return choose(outcomes, all_scores, used, name, saturated)


def choose(
    outcomes: Outcomes,
    all_scores: FloatArray,
    draws: Sequence[Mapping[str, float]],
    name: str,
    saturated: bool | None,
) -> CrossValidation:
    """Apply to each object the draw that is best on all others (the first one of equals).

    Args:
        outcomes: of N grasps.
        all_scores: shape (D, N).
        draws: the D parameter sets.
        name: of the model.
        saturated: for the record.
    """
    ap = np.array(
        [
            [
                OBJECT_METRICS["ap"](one, values, None)[0]
                for one, values in zip(outcomes.objects, outcomes.split(scores), strict=True)
            ]
            for scores in all_scores
        ]
    )
    held_out_scores = np.empty(all_scores.shape[1])
    objects = {}
    for position, (one, where) in enumerate(zip(outcomes.objects, outcomes.indices, strict=True)):
        training = np.nanmean(np.delete(ap, position, axis=1), axis=1)
        best = int(np.argmax(training))
        held_out_scores[where] = all_scores[best][where]
        metrics = object_metrics(outcomes, all_scores[best])[one.name]
        objects[one.name] = HeldOut(best, draws[best], float(training[best]), metrics)
    mean = mean_metrics(outcomes, held_out_scores)
    return CrossValidation(name, saturated, mean, objects, held_out_scores)
