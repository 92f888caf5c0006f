"""Rivals that a quick comparison leaves open are looked at more closely."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from reach.arrays import FloatArray
from reach.symmetry import pose_distance
from registration.close_look import CloseLook
from registration.job import Job
from registration.search import Hypothesis

ENOUGH = 4.0
"""Log odds that rule a rival out. Along a direction that the fit leaves open, half a percent of a
normal distribution lies further off on both sides."""
CLEAR = 12.0
"""Log odds of the quick comparison that need no second look."""
LEAST_SHARE = 0.5
"""Of the evidence that the chosen pose promises against a rival, at least this share must be there:
less is what a third pose shows, to which the chosen one is no nearer than the rival."""
BEATEN = -2.0
"""A rival with log odds of this against the chosen pose is taken for the better one."""
MOST_LOOKS = 16
SAME_TURN, SAME_SHIFT = np.radians(3.0), 1e-3
"""Rivals closer to each other are one."""
HARMLESS = 1e-3
"""A rival whose surface parts by less may go unasked: the search for a harmful one goes on [m]."""


@dataclass(frozen=True, slots=True, eq=False)
class RatedRival:
    """A physically different hypothesis.

    Args:
        hypothesis: the rival.
        margin: evidence for the chosen hypothesis against it.
        log_odds: natural logarithm of how much more likely the image makes the chosen one.
        ruled_out: whether that is evidence enough.
    """

    hypothesis: Hypothesis
    margin: float
    log_odds: float
    ruled_out: bool

    @property
    def clear(self) -> bool:
        """Whether it is ruled out without a second look."""
        return self.ruled_out and self.log_odds >= CLEAR


def moved(hypothesis: Hypothesis, T: FloatArray) -> Hypothesis:
    """The hypothesis at a pose nearby, with that pose's render cost; it keeps its fit."""
    cost = float(hypothesis.search.check(T[None]).cost[0])
    return replace(hypothesis, T_camera_object=T, cost=cost)


class Doubt:
    """Looks closely at the rivals of one hypothesis.

    Args:
        job: the registration.
        look: at the hypothesis's image.
        chosen: the hypothesis, aligned.
        declared: whether it keeps to a declared stable pose, which no rival here changes.
    """

    def __init__(self, job: Job, look: CloseLook, chosen: Hypothesis, *, declared: bool) -> None:
        self._job, self._look, self._chosen, self._declared = job, look, chosen, declared
        self._better: tuple[float, Hypothesis] | None = None

    @property
    def better(self) -> Hypothesis | None:
        """The rival, aligned, that most clearly beats the hypothesis; None if none looked at does."""
        return None if self._better is None else self._better[1]

    def settled(self, rivals: Sequence[RatedRival]) -> list[RatedRival]:
        """The rivals, those ruled out that a close look rules out.

        Args:
            rivals: of the hypothesis's own search, hardest first; those clearly ruled out stay so.
        """
        result: list[RatedRival] = []
        looked: list[tuple[FloatArray, RatedRival]] = []
        stop = False
        for rival in rivals:
            T = rival.hypothesis.T_camera_object
            if rival.clear or stop:
                result.append(rival)
                continue
            rated = next((r for known, r in looked if self._same(known, T)), None)
            if rated is not None:
                rated = replace(rated, hypothesis=rival.hypothesis)
            elif len(looked) < MOST_LOOKS:
                best = self._apart(T)
                rated = self._rated(rival, best)
                self._remember(rated, best)
                looked.append((T, rated))
            else:
                rated = rival
            result.append(rated)
            stop = not rated.ruled_out and self._harmful(T)
        return result

    def end(self, rival: RatedRival) -> RatedRival:
        """The same for a pose along an open direction, which must stay where it is."""
        T = rival.hypothesis.T_camera_object
        turn, _ = pose_distance(self._job.sym, self._chosen.T_camera_object, T)
        if turn > self._job.options.max_turn_error / 2:
            T = self._look.aligned(T, turning=False)
        rated = self._rated(rival, T)
        if rated.log_odds < BEATEN:
            self._remember(rated, self._look.aligned(T))
        return rated

    def _rated(self, rival: RatedRival, T: FloatArray) -> RatedRival:
        share, odds = self._look.weigh(self._chosen.T_camera_object, T)
        ruled_out = odds >= ENOUGH and share >= LEAST_SHARE and rival.log_odds > -ENOUGH
        return RatedRival(rival.hypothesis, float(np.clip(share, -1.0, 1.0)), odds, ruled_out)

    def _remember(self, rival: RatedRival, T: FloatArray) -> None:
        """Note a rival, at its own best T, that beats the hypothesis on the same stable pose."""
        least = BEATEN if self._better is None else self._better[0]
        same = rival.hypothesis.stable_pose == self._chosen.stable_pose
        if rival.log_odds < least and (same or not self._declared):
            self._better = (rival.log_odds, moved(rival.hypothesis, T))

    def _apart(self, T: FloatArray) -> FloatArray:
        """The rival at its own best, or only slid there if it turns into the chosen pose."""
        best = self._look.aligned(T)
        if self._job.differ(self._chosen.T_camera_object, best):
            return best
        return self._look.aligned(T, turning=False)

    def _same(self, a: FloatArray, b: FloatArray) -> bool:
        turn, shift = pose_distance(self._job.sym, a, b)
        return turn < SAME_TURN and shift < SAME_SHIFT

    def _harmful(self, T: FloatArray) -> bool:
        apart = self._job.model.surface_distance(self._chosen.T_camera_object, T)
        return apart > HARMLESS
