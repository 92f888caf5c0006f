"""Reliability Q: how often a grasp holds when pose, friction and mass are not quite as planned."""

from __future__ import annotations

import operator
from collections import Counter
from dataclasses import dataclass

import numpy as np

from reach.arrays import FloatArray, positive
from reach.errors import InvalidInputError
from reach.grasp import Grasp
from reach.models.base import ContactModel
from reach.pose_error import PoseError
from reach.scene import Scene
from reach.transforms import exp

FRICTION_SPREAD = 0.1
"""Relative standard deviation of friction."""
MASS_SPREAD = 0.05
"""Relative standard deviation of mass."""
CONFIDENCE_Z = 1.959963984540054
"""Standard normal quantile of a two-sided interval of 95 %."""
BLOCK = 25
"""Samples that the adaptive mode adds at a time."""
SMALLEST_FACTOR = 0.05
"""Factors of friction and mass are cut off here, so that neither turns zero or negative."""


@dataclass(frozen=True, slots=True)
class Reliability:
    """The share of perturbed grasps that hold.

    Attributes:
        value: the mean of the verdicts, in [0, 1].
        low: lower end of the Wilson interval of 95 %.
        high: upper end.
        samples: how many verdicts were drawn.
        counts: how many verdicts gave each reason.
        mean_margin: mean of the margins, each capped by the model.
    """

    value: float
    low: float
    high: float
    samples: int
    counts: dict[str, int]
    mean_margin: float


def wilson_interval(successes: int, trials: int, z: float = CONFIDENCE_Z) -> tuple[float, float]:
    """Wilson's interval of a probability, from a number of successes ([Wilson1927])."""
    share = successes / trials
    shrink = 1.0 + z * z / trials
    middle = (share + z * z / (2 * trials)) / shrink
    half = z / shrink * np.sqrt(share * (1 - share) / trials + z * z / (4 * trials * trials))
    return max(0.0, float(middle - half)), min(1.0, float(middle + half))


def reliability(
    model: ContactModel,
    scene: Scene,
    grasp: Grasp,
    *,
    pose_error: PoseError,
    samples: int = 100,
    seed: int = 0,
    friction_spread: float = FRICTION_SPREAD,
    mass_spread: float = MASS_SPREAD,
    adaptive: float | None = None,
) -> Reliability:
    """Estimate how reliably a grasp resists gravity ([Danielczuk2019] Sect. 4.3).

    The part's true pose is `T_world_object @ exp(xi)`, xi normal with the given covariance, while
    the gripper stands where it was planned. Friction and mass are multiplied by independent
    normal factors of mean one, cut off at 0.05. Gravity is that of the believed pose.

    Args:
        model: judges each sample.
        scene: part, gripper and believed pose.
        grasp: as planned, for the believed pose.
        pose_error: a station's, or a trial's own registration covariance.
        samples: number of verdicts; the most that the adaptive mode draws.
        seed: of the random numbers; the first n samples are the same for every larger n.
        friction_spread: relative standard deviation.
        mass_spread: relative standard deviation.
        adaptive: stop as soon as the interval is narrower than this; None draws all samples.

    Raises:
        InvalidInputError: no samples, a negative seed or spread, or a width that is not positive.
    """
    check_counts(samples, seed)
    positive(friction_spread, "friction_spread", zero_allowed=True)
    positive(mass_spread, "mass_spread", zero_allowed=True)
    width = 0.0 if adaptive is None else positive(adaptive, "adaptive (interval width)")
    drawn_at_once = samples if adaptive is None else BLOCK
    T, friction, mass = draw_samples(
        scene, grasp, pose_error, samples, seed, friction_spread, mass_spread
    )
    friction *= float(model.parameters["friction"])
    held, count, margin = 0, 0, 0.0
    counts: Counter[str] = Counter()
    while True:
        part = slice(count, min(count + drawn_at_once, samples))
        batch = model.evaluate_batch(
            scene,
            T[part],
            force=grasp.force,
            friction=friction[part],
            mass=mass[part],
            opening=grasp.opening,
        )
        held, count = held + int(batch.resists.sum()), part.stop
        margin += float(batch.margin.sum())
        counts.update(batch.counts())
        low, high = wilson_interval(held, count)
        if count == samples or high - low < width:
            return Reliability(held / count, low, high, count, dict(counts), margin / count)


def check_counts(samples: int, seed: int) -> None:
    """Refuse a number of samples or a seed that is none.

    Raises:
        InvalidInputError: naming the one that is not a whole number, or too small.
    """
    for name, value, least in (("samples", samples, 1), ("seed", seed, 0)):
        try:
            fits = operator.index(value) >= least
        except TypeError:
            fits = False
        if not fits:
            raise InvalidInputError(
                f"{name} is {value!r}, expected a whole number, at least {least}"
            )


def draw_samples(
    scene: Scene,
    grasp: Grasp,
    pose_error: PoseError,
    samples: int,
    seed: int,
    friction_spread: float = FRICTION_SPREAD,
    mass_spread: float = MASS_SPREAD,
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Draw what a grasp may really meet, from the distribution of [reliability][].

    Returns:
        T_object_gripper for the true pose of the part (N, 4, 4), factors of friction (N,), and
        masses (N,) [kg].
    """
    normal = np.random.default_rng(seed).standard_normal((samples, 8))
    T_true_believed = exp(-pose_error.from_standard(normal[:, :6]))
    factors = np.maximum(1.0 + normal[:, 6:] * (friction_spread, mass_spread), SMALLEST_FACTOR)
    return (
        T_true_believed @ grasp.T_object_gripper,
        factors[:, 0],
        factors[:, 1] * scene.object.mass,
    )
