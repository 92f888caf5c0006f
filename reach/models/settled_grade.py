"""From a verdict to a chance: how firmly a settled part is held.

A mean of yes and no loses what a hold is worth: a part held at the rim of a pad, by a sliver of
surface, or with friction nearly used up is lost more often than one held in the middle. The
chance that a sample succeeds is a logistic function of three quantities with a meaning, rising
with each; a sample that fails has one chance of its own. The five numbers are fitted, see
docs/decisions/0091.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from reach.arrays import FloatArray
from reach.gripper import ParallelJawGripper
from reach.models.settled import Settled

DEEP_INSIDE = 0.5
"""Pressure this far from the outline, in parts of half the pad's width, is as good as any."""
MOST_PRELOAD = 1.5


@dataclass(frozen=True, slots=True)
class Grade:
    """A logistic chance of success of one settled sample, in log odds.

    Args:
        held: of a sample that holds with nothing in its favor.
        area: added times the root of the pad's share that the part covers, of the lesser jaw.
        inside: added times the distance of the pressure from the pad's outline, in parts of half
            the pad's width, up to one half, of the lesser jaw.
        preload: taken off times the share of friction that the preload uses up.
        failed: of a sample that fails.
    """

    held: float
    area: float
    inside: float
    preload: float
    failed: float

    @property
    def version(self) -> str:
        """The numbers, for the record."""
        numbers = (self.held, self.area, self.inside, self.preload, self.failed)
        return " ".join(f"{number:g}" for number in numbers)

    def chances(self, gripper: ParallelJawGripper, told: Settled) -> FloatArray:
        """Chance of each sample, shape (N,)."""
        weights = np.array([self.held, self.area, self.inside, -self.preload, self.failed])
        chance: FloatArray = 1.0 / (1.0 + np.exp(-quantities(gripper, told) @ weights))
        return chance


def quantities(gripper: ParallelJawGripper, told: Settled) -> FloatArray:
    """What the log odds are linear in, shape (N, 5).

    Columns: held or not, root of the covered share, distance to the outline, share of friction
    used by the preload (all zero unless held), and failed or not.
    """
    pads = [jaw.pad for jaw in gripper.jaws]
    held = told.margin >= 1.0
    preload, area, inside = told.features[:, 3], told.features[:, 4], told.features[:, 5]
    share = np.clip(area / min(pad.area for pad in pads), 0.0, 1.0)
    depth = np.clip(inside / (0.5 * min(pad.width for pad in pads)), 0.0, DEEP_INSIDE)
    columns = [
        np.ones(len(held)),
        np.sqrt(share),
        depth,
        np.clip(preload, 0.0, MOST_PRELOAD),
    ]
    return np.column_stack([*(held * column for column in columns), ~held])


GRADE = Grade(held=-1.7, area=3.9, inside=9.6, preload=1.1, failed=-1.54)
