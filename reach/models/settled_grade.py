"""From verdicts to a chance: how often, and how firmly, a settled part is held.

The mean of yes and no loses what a hold is worth: a part held at the rim of a pad, or by a sliver
of surface, is lost more often than one held in the middle. The chance is a logistic function of
two quantities with a meaning, and rises with both: the share of samples that hold, and how far
inside the pads' outline the held part is pressed. The three numbers are fitted on simulated
trials; what else was tried is in docs/decisions/0091.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from reach.arrays import FloatArray
from reach.gripper import ParallelJawGripper
from reach.models.settled import Settled

DEEP_INSIDE = 0.5
"""Pressure this far from the outline, in parts of half the pad's width, is as good as any."""


@dataclass(frozen=True, slots=True)
class Grade:
    """A logistic chance of success; log odds by quantity.

    Args:
        offset: of a grasp with nothing in its favor.
        share: for each unit of the log odds of a sample to hold.
        inside: for pressure half the pad's width from the outline.
        certain: a chance from here on counts as 1; the fit cannot tell it from certainty.
    """

    offset: float
    share: float
    inside: float
    certain: float = 0.97

    @property
    def version(self) -> str:
        """The numbers, for the record."""
        return " ".join(f"{n:g}" for n in (self.offset, self.share, self.inside, self.certain))

    def chance(self, gripper: ParallelJawGripper, told: Settled) -> float:
        """Chance of a grasp, in [0, 1], from its settled samples."""
        weights = np.array([self.offset, self.share, self.inside])
        chance = float(1.0 / (1.0 + np.exp(-quantities(gripper, told) @ weights)))
        return 1.0 if chance >= self.certain else chance


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


GRADE = Grade(offset=-0.73, share=0.83, inside=3.76)
