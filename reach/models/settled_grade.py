"""From verdicts to a rate: how often, and how firmly, a settled part is held.

The mean of yes and no loses what a hold is worth: a part held at the rim of a pad, or by a sliver
of surface, is lost more often than one held in the middle. The log odds of success are linear in
two quantities with a meaning, and rise with both: the share of samples that hold, and how far
inside the pads' outline the held part is pressed.

Grasps that look alike to the model do not succeed equally often: what it does not know is common to
all trials of a grasp. Their rates are taken for Beta-distributed about that mean. The score is the
median rate: half of such grasps do better, half do worse. It has the least mean absolute error,
and a record that is nearly certain counts as certain without a rule that says so. It is told in
whole samples; finer than one sample nothing was measured.

The numbers are fitted on simulated trials; what else was tried is in docs/decisions/0093.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.special import betaincinv, expit

from reach.arrays import FloatArray
from reach.gripper import ParallelJawGripper
from reach.models.settled import Settled

DEEP_INSIDE = 0.5
"""Pressure this far from the outline, in parts of half the pad's width, is as good as any."""
LEAST = 1e-9
"""The mean rate keeps this distance from 0 and 1, where a Beta distribution ends."""


@dataclass(frozen=True, slots=True)
class Grade:
    """Distribution of the success rates of grasps that look alike.

    Args:
        offset: log odds of a grasp with nothing in its favor.
        share: log odds for each unit of the log odds of a sample to hold.
        inside: log odds for pressure half the pad's width from the outline.
        alike: how much such grasps are alike: the rates vary by m (1 - m) / (1 + alike) about
            their mean m, as if each grasp were known from this many trials.
    """

    offset: float
    share: float
    inside: float
    alike: float

    @property
    def version(self) -> str:
        """The numbers, for the record."""
        return " ".join(f"{n:g}" for n in (self.offset, self.share, self.inside, self.alike))

    def rate(self, gripper: ParallelJawGripper, told: Settled) -> float:
        """Median success rate of grasps whose settled samples are like these, in [0, 1]."""
        weights = np.array([self.offset, self.share, self.inside])
        mean = float(np.clip(expit(quantities(gripper, told) @ weights), LEAST, 1.0 - LEAST))
        median = float(betaincinv(self.alike * mean, self.alike * (1.0 - mean), 0.5))
        return round(median * len(told.margin)) / len(told.margin)


def quantities(gripper: ParallelJawGripper, told: Settled) -> FloatArray:
    """What the log odds are linear in, shape (3,): 1, log odds to hold, and distance inside.

    A share of k of n counts as (k + 1/2) / (n + 1). The distance of the center of pressure from
    the pad's outline, of the lesser jaw and in parts of half the pad's width, is a mean over the
    samples that hold, zero if none does.
    """
    held = told.margin >= 1.0
    count = int(held.sum())
    log_odds = float(np.log((count + 0.5) / (len(held) - count + 0.5)))
    if not count:
        return np.array([1.0, log_odds, 0.0])
    half_width = 0.5 * min(jaw.pad.width for jaw in gripper.jaws)
    inside = np.clip(told.features[held, 5] / half_width, 0.0, DEEP_INSIDE)
    return np.array([1.0, log_odds, inside.mean()])


GRADE = Grade(offset=-1.07, share=0.79, inside=4.83, alike=3.0)
