"""A station's own parameters from labeled grasps, with intervals, and whether they can be told.

The labels of a grasp are binomial with the probability that the robust model gives it. The
likelihood over a grid of friction, compliance and pose error is maximized; each parameter's
interval is where its profile (the best over the other two) stays above the cut-off of a
chi-square. Grasps scatter more than binomially around any model, and the cut-off is widened by
that overdispersion. A parameter whose interval reaches across the whole grid cannot be told
from these data: with a 3 g cube any friction holds.

Sources:
    [McCullagh1989] McCullagh, Nelder, Generalized Linear Models, Sect. 4.5 (overdispersion).
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from reach.arrays import FloatArray
from reach.errors import InvalidInputError
from reach.evaluation.cases import GraspCase
from reach.evaluation.scoring import Scorer, score_draws
from reach.pose_error import PoseError

GRID: Mapping[str, tuple[float, ...]] = {
    "friction": (0.2, 0.3, 0.4, 0.55, 0.75, 1.0),
    "compliance": (5e-5, 1e-4, 2e-4, 2.65e-4),
    "translation": (2.5e-4, 5e-4, 1e-3, 2e-3, 4e-3),
}
"""Friction, compliance [m/N] (20 N times the last is the pad's limit), pose error [m]."""

SETTLED_GRID: Mapping[str, tuple[float, ...]] = {
    "friction": GRID["friction"],
    "stiffness": (3.75e7, 7.5e7, 1.5e8, 3e8, 6e8),
    "translation": GRID["translation"],
}
"""The settled model has pads' stiffness k_w [N/m^3] for a compliance."""

ROTATION_PER_TRANSLATION = 3.0
"""Radians of rotation error to a meter of translation error: 3 mrad to 1 mm, as in the trials."""
CUT_OFF = 3.841458820694124
"""95 % quantile of chi-square with one degree of freedom."""
FEWEST_GRASPS = 8
MakeScorer = Callable[..., Scorer]
Progress = Callable[[int, int], None]


def grid_of(model: str) -> Mapping[str, tuple[float, ...]]:
    """Values of the parameters that a robust model has."""
    return SETTLED_GRID if model.startswith("settled") else GRID


@dataclass(frozen=True, slots=True)
class FittedParameter:
    """One parameter.

    Args:
        name: of it.
        best: most likely value on the grid.
        low: lower end of its 95 % interval; the grid's end if the data set no bound there.
        high: upper end.
        bounded_below: whether the data exclude the grid's smallest value.
        bounded_above: whether they exclude its largest one.
        profile: grid value -> log likelihood below the best, at the best of the others.
    """

    name: str
    best: float
    low: float
    high: float
    bounded_below: bool
    bounded_above: bool
    profile: Mapping[float, float]

    @property
    def told(self) -> bool:
        """Whether the data say anything about it."""
        return self.bounded_below or self.bounded_above

    def to_json(self) -> dict[str, Any]:
        """The parameter as plain JSON values."""
        return {
            "best": self.best if self.told else None,
            "interval": [self.low, self.high],
            "bounded_below": self.bounded_below,
            "bounded_above": self.bounded_above,
            "told": self.told,
            "profile": {f"{value:g}": drop for value, drop in self.profile.items()},
        }


@dataclass(frozen=True, slots=True)
class Fit:
    """All parameters.

    Args:
        parameters: by name.
        overdispersion: scatter of the grasps around the best model, 1 if binomial.
        grasps: number of grasps.
        trials: number of labels.
    """

    parameters: Mapping[str, FittedParameter]
    overdispersion: float
    grasps: int
    trials: int


def fit_parameters(
    cases: Sequence[GraspCase],
    make: MakeScorer,
    *,
    model: str = "reach-robust",
    samples: int = 50,
    seed: int = 0,
    grid: Mapping[str, tuple[float, ...]] | None = None,
    backend: str = "serial",
    progress: Progress | None = None,
) -> Fit:
    """Maximize the likelihood of the labels over the grid.

    Args:
        cases: labeled grasps.
        make: makes a scorer by name and parameters.
        model: a robust model.
        samples: perturbations a score.
        seed: of the perturbations, the same for every grid point.
        grid: values of friction, compliance or stiffness, and, last, pose error; the model's own
            if None.
        backend: see [score_cases][reach.evaluation.scoring.score_cases].
        progress: called with the number of grasps done, once for each pose error, and their total.

    Raises:
        InvalidInputError: too few grasps for three parameters.
    """
    if len(cases) < FEWEST_GRASPS:
        raise InvalidInputError(
            f"{len(cases)} labeled grasps cannot tell three parameters; it takes {FEWEST_GRASPS}"
        )
    grid = grid_of(model) if grid is None else grid
    *contact, (_, errors) = grid.items()
    names = tuple(grid)
    sets = [
        make(model, samples=samples, **dict(zip(names, values, strict=False)))
        for values in itertools.product(*(values for _, values in contact))
    ]
    reliabilities = np.stack(
        [
            score_draws(
                cases,
                sets,
                pose_error=PoseError.isotropic(
                    translation=error, rotation=ROTATION_PER_TRANSLATION * error
                ),
                seed=seed,
                backend=backend,
                progress=_part_of(progress, number, len(errors)),
            )
            for number, error in enumerate(errors)
        ],
        axis=1,
    )
    shape = [len(values) for values in grid.values()]
    points = reliabilities.reshape(-1, len(cases))
    likelihood = np.array([log_likelihood(cases, p, samples) for p in points]).reshape(shape)
    top = int(np.argmax(likelihood))
    best = np.unravel_index(top, likelihood.shape)
    overdispersion = _overdispersion(cases, points[top], samples)
    drop = (likelihood - likelihood.max()) / overdispersion
    fitted = {
        name: _profiled(name, grid[name], drop, axis, int(best[axis]))
        for axis, name in enumerate(names)
    }
    return Fit(fitted, overdispersion, len(cases), sum(case.trials for case in cases))


def _part_of(progress: Progress | None, number: int, parts: int) -> Progress | None:
    """Progress of one of several equal parts as progress of the whole."""
    if progress is None:
        return None
    return lambda done, total: progress(number * total + done, parts * total)


def log_likelihood(cases: Sequence[GraspCase], values: FloatArray, samples: int) -> float:
    """Log likelihood of the labels, a score of k of n samples counting as (k + 1/2) / (n + 1)."""
    successes, trials, p = _binomial(cases, values, samples)
    return float((successes * np.log(p) + (trials - successes) * np.log1p(-p)).sum())


def _binomial(
    cases: Sequence[GraspCase], values: FloatArray, samples: int
) -> tuple[FloatArray, FloatArray, FloatArray]:
    successes = np.array([case.successes for case in cases], dtype=float)
    trials = np.array([case.trials for case in cases], dtype=float)
    return successes, trials, (values * samples + 0.5) / (samples + 1.0)


def _overdispersion(cases: Sequence[GraspCase], values: FloatArray, samples: int) -> float:
    """Deviance of the grasps around a model to its degrees of freedom, at least 1."""
    successes, trials, p = _binomial(cases, values, samples)
    rate = successes / trials
    with np.errstate(divide="ignore", invalid="ignore"):
        won = np.where(successes > 0, successes * np.log(rate / p), 0.0)
        lost = np.where(successes < trials, (trials - successes) * np.log((1 - rate) / (1 - p)), 0)
    return max(1.0, float(2.0 * (won + lost).sum() / (len(cases) - 3)))


def _profiled(
    name: str, values: Sequence[float], drop: FloatArray, axis: int, best: int
) -> FittedParameter:
    others = tuple(k for k in range(drop.ndim) if k != axis)
    profile = drop.max(axis=others)
    inside = np.flatnonzero(profile >= -0.5 * CUT_OFF)
    return FittedParameter(
        name,
        float(values[best]),
        float(values[inside[0]]),
        float(values[inside[-1]]),
        bool(inside[0] > 0),
        bool(inside[-1] < len(values) - 1),
        {float(v): float(d) for v, d in zip(values, profile, strict=True)},
    )
