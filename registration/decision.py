"""Choose among hypotheses, and tell which others the image does not rule out."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from reach.symmetry import pose_distance
from registration.evidence import pairwise_margins
from registration.job import Job
from registration.search import Hypothesis

CLEARLY_WORSE = 0.15
"""A pose whose render cost is this far above the best one's needs no closer comparison."""
REFUTED = 0.4
"""With this much evidence for another stable pose, the declared one is taken to be wrong."""
MOST_RIVALS = 5
VARIANT, TURNED = 1.8e-3, np.radians(5.0)
"""A part that is nearly symmetric (a gear with a keyway) may be turned with its surfaces parting
by less than `SensorProfile.distinct`; that is another pose from these distances on [m, rad]."""


@dataclass(frozen=True, slots=True, eq=False)
class RatedRival:
    """A physically different hypothesis.

    Args:
        hypothesis: the rival.
        margin: evidence for the chosen hypothesis against it.
        ruled_out: whether that is evidence enough.
    """

    hypothesis: Hypothesis
    margin: float
    ruled_out: bool


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
    chosen = _winner(job, near)
    contradicts = False
    if declared is not None and chosen.stable_pose != declared:
        own = [h for h in near if h.stable_pose == declared]
        champion = _winner(job, own) if own else None
        if champion is not None and not _refuted(job, champion, chosen):
            chosen = champion
        else:
            contradicts = True
    rivals = _rivals(job, chosen, found)
    # All that are not ruled out are told; of the others, the strongest.
    count = max(MOST_RIVALS, sum(not rival.ruled_out for rival in rivals))
    return Decision(chosen, tuple(rivals[:count]), contradicts)


def _refuted(job: Job, declared: Hypothesis, other: Hypothesis) -> bool:
    """Whether the image speaks clearly for another stable pose than the declared one."""
    if not _differ(job, declared, other):
        return False
    if declared.search is not other.search:
        return declared.cost > other.cost + CLEARLY_WORSE / 2
    return float(_margins(job, other, [declared])[0]) > REFUTED


def _winner(job: Job, near: Sequence[Hypothesis]) -> Hypothesis:
    """The hypothesis that no other one beats on the pixels where they differ."""
    best = near[0]
    for _ in range(len(near)):
        others = [h for h in near if h is not best and h.search is best.search]
        margins = _margins(job, best, others)
        if len(margins) == 0 or margins.min() >= 0:
            break
        best = others[int(np.argmin(margins))]
    return best


def _rivals(job: Job, chosen: Hypothesis, found: Sequence[Hypothesis]) -> list[RatedRival]:
    near = [h for h in found if h.cost <= chosen.cost + CLEARLY_WORSE]
    here = [h for h in near if h.search is chosen.search and _differ(job, chosen, h)]
    rated = [
        RatedRival(h, float(margin), bool(margin >= _required(job, chosen, h)))
        for h, margin in zip(here, _margins(job, chosen, here), strict=True)
    ]
    # Another thing on the table that the part explains as well: which one is meant, no pixel
    # can tell.
    rated += [
        RatedRival(h, 0.0, ruled_out=False)
        for h in found
        if h.search is not chosen.search
        and h.cost <= job.profile.max_cost
        and _differ(job, chosen, h)
    ]
    return sorted(rated, key=lambda rival: (rival.ruled_out, rival.margin))


def _required(job: Job, chosen: Hypothesis, rival: Hypothesis) -> float:
    """Evidence that rules a rival out: less for a variant of a nearly symmetric part.

    A variant's few differing pixels cannot give much evidence, and mistaking it moves no
    surface by more than `SensorProfile.distinct`.
    """
    apart = job.model.surface_distance(chosen.T_camera_object, rival.T_camera_object)
    profile = job.profile
    return profile.min_margin if apart > profile.distinct else profile.variant_margin


def _margins(
    job: Job, first: Hypothesis, others: Sequence[Hypothesis]
) -> np.ndarray[tuple[int], np.dtype[np.float64]]:
    if not others:
        return np.zeros(0)
    poses = np.stack([h.T_camera_object for h in (first, *others)])
    search = first.search
    return pairwise_margins(job.model, search.seen, poses, search.fine_tolerance)


def _differ(job: Job, a: Hypothesis, b: Hypothesis) -> bool:
    """Whether two poses put the part's surface elsewhere; symmetric poses do not differ."""
    apart = job.model.surface_distance(a.T_camera_object, b.T_camera_object)
    if apart < min(VARIANT, job.profile.distinct):
        return False
    turn, _ = pose_distance(job.sym, a.T_camera_object, b.T_camera_object)
    return apart > job.profile.distinct or turn > TURNED
