"""Choose among hypotheses, and tell which others the image does not rule out."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from registration.doubt import CLEAR, ENOUGH, Doubt, RatedRival, moved
from registration.job import Job
from registration.refine import NEAR, fit_of
from registration.search import Hypothesis
from registration.unobservable import open_ways

CLEARLY_WORSE = 0.15
"""A pose whose render cost is this far above the best one's needs no closer comparison."""
REFUTED = 0.4
"""With this much evidence for another stable pose, the declared one is taken to be wrong."""
MOST_RIVALS = 5
SECOND_THOUGHTS = 2
"""So many times a close look may turn to a rival."""


@dataclass(frozen=True, slots=True, eq=False)
class Decision:
    """The chosen hypothesis and its standing.

    Args:
        chosen: the hypothesis that explains the image best.
        rivals: physically different hypotheses, strongest first.
        contradicts_declared: it keeps to another stable pose than the declared one.
    """

    chosen: Hypothesis
    rivals: tuple[RatedRival, ...]
    contradicts_declared: bool

    @property
    def margin(self) -> float:
        """Evidence against the strongest rival; 1 without one."""
        return min((rival.margin for rival in self.rivals), default=1.0)

    @property
    def ambiguous(self) -> bool:
        """Whether some rival is not ruled out."""
        return any(not rival.ruled_out for rival in self.rivals)


def decide(job: Job, found: Sequence[Hypothesis], declared: int | None) -> Decision:
    """Choose by render cost; near ties by the pixels where the hypotheses differ.

    Args:
        job: the registration.
        found: hypotheses by rising cost, at least one.
        declared: index of the declared stable pose, None if there is none.
    """
    near = [h for h in found if h.cost <= found[0].cost + CLEARLY_WORSE]
    chosen = _winner(job, [h for h in near if h.cost <= found[0].cost + NEAR])
    contradicts = False
    if declared is not None and chosen.stable_pose != declared:
        own = [h for h in near if h.stable_pose == declared]
        champion = _winner(job, own) if own else None
        if champion is not None and not _refuted(job, champion, chosen):
            chosen = champion
        else:
            contradicts = True
    chosen, rivals = _settled(job, chosen, found, declared=declared is not None)
    # All that are not ruled out are told; of the others, the strongest.
    count = max(MOST_RIVALS, sum(not rival.ruled_out for rival in rivals))
    return Decision(chosen, tuple(rivals[:count]), contradicts)


def _refuted(job: Job, declared: Hypothesis, other: Hypothesis) -> bool:
    """Whether the image speaks clearly for another stable pose than the declared one."""
    if not _differ(job, declared, other):
        return False
    if declared.search is not other.search:
        return declared.cost > other.cost + CLEARLY_WORSE / 2
    return float(job.weigh(other, [declared]).margin[0]) > REFUTED


def _winner(job: Job, near: Sequence[Hypothesis]) -> Hypothesis:
    """The hypothesis that no other one beats on the pixels where they differ."""
    best = near[0]
    for _ in range(len(near)):
        others = [h for h in near if h is not best and h.search is best.search]
        if not others:
            break
        odds = job.weigh(best, others).log_odds
        if odds.min() >= 0:
            break
        best = others[int(np.argmin(odds))]
    return best


def _settled(
    job: Job, chosen: Hypothesis, found: Sequence[Hypothesis], *, declared: bool
) -> tuple[Hypothesis, list[RatedRival]]:
    """The hypothesis to go on with and its rivals, looked at closely where doubt remains."""
    rivals = _rivals(job, chosen, found)
    if all(rival.clear or rival.hypothesis.search is not chosen.search for rival in rivals):
        return chosen, rivals
    look = job.close_look(chosen.search)
    chosen = moved(chosen, look.aligned(chosen.T_camera_object))
    for thought in range(SECOND_THOUGHTS + 1):
        doubt = Doubt(job, look, chosen, declared=declared)
        rivals = _rivals(job, chosen, found, doubt)
        if doubt.better is None or thought == SECOND_THOUGHTS:
            break
        chosen = doubt.better
    return chosen, rivals


def _rivals(
    job: Job, chosen: Hypothesis, found: Sequence[Hypothesis], doubt: Doubt | None = None
) -> list[RatedRival]:
    """Other poses than the chosen one, those that the image leaves open first."""
    near = [h for h in found if h.cost <= chosen.cost + CLEARLY_WORSE]
    here = [h for h in near if h.search is chosen.search and _differ(job, chosen, h)]
    rated = []
    if here:
        evidence = job.weigh(chosen, here)
        rated = [
            RatedRival(h, float(margin), float(odds), _rules_out(job, float(margin), float(odds)))
            for h, margin, odds in zip(here, evidence.margin, evidence.log_odds, strict=True)
        ]
    if doubt is not None:
        rated = doubt.settled(sorted(rated, key=lambda rival: rival.log_odds))
    rated += _open_ends(job, chosen, doubt)
    # Another thing on the table that the part explains as well: which one is meant, no pixel
    # can tell.
    rated += [
        RatedRival(h, 0.0, 0.0, ruled_out=False)
        for h in found
        if h.search is not chosen.search
        and h.cost <= job.profile.max_cost
        and _differ(job, chosen, h)
    ]
    return sorted(rated, key=lambda rival: (rival.ruled_out, rival.margin))


def _open_ends(job: Job, chosen: Hypothesis, doubt: Doubt | None) -> list[RatedRival]:
    """Where the part may be along directions that the fit leaves open, and the image too.

    The fit knows only where points lie; the image also shows what the camera would have seen.
    """
    ways = open_ways(
        chosen.T_camera_object,
        fit_of(job, chosen).covariance,
        job.obj.com,
        job.options.max_turn_error,
        job.options.max_shift_error,
    )
    ends = []
    for way in ways:
        poses = [replace(chosen, T_camera_object=T, polished=None) for T in way.poses]
        poses = [pose for pose in poses if _differ(job, chosen, pose)]
        if not poses:
            continue
        evidence = job.weigh(chosen, poses)
        quick = zip(poses, evidence.margin, evidence.log_odds, strict=True)
        steps = [
            RatedRival(pose, float(margin), float(odds), ruled_out=False)
            for pose, margin, odds in quick
            if odds < CLEAR
        ]
        if doubt is not None:
            steps = [doubt.end(step) for step in steps]
        last = next((step for step in reversed(steps) if not step.ruled_out), None)
        if last is not None:
            T = last.hypothesis.T_camera_object
            cost = float(chosen.search.check(T[None]).cost[0])
            ends.append(replace(last, hypothesis=replace(last.hypothesis, cost=cost)))
    return ends


def _rules_out(job: Job, margin: float, log_odds: float) -> bool:
    """The noise could not have turned one pose's image into the other's, nor could a few pixels."""
    return margin >= job.profile.min_margin and log_odds >= ENOUGH


def _differ(job: Job, a: Hypothesis, b: Hypothesis) -> bool:
    return job.differ(a.T_camera_object, b.T_camera_object)
