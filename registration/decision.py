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
class Decision:
    """The chosen hypothesis and its standing.

    Args:
        chosen: the hypothesis that explains the image best.
        margin: evidence for it against the strongest physically different one.
        rivals: physically different hypotheses with their margins, strongest first.
        contradicts_declared: it keeps to another stable pose than the declared one.
    """

    chosen: Hypothesis
    margin: float
    rivals: tuple[tuple[Hypothesis, float], ...]
    contradicts_declared: bool


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
    margin = min((m for _, m in rivals), default=1.0)
    return Decision(chosen, margin, tuple(rivals[:MOST_RIVALS]), contradicts)


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


def _rivals(
    job: Job, chosen: Hypothesis, found: Sequence[Hypothesis]
) -> list[tuple[Hypothesis, float]]:
    near = [h for h in found if h.cost <= chosen.cost + CLEARLY_WORSE]
    here = [h for h in near if h.search is chosen.search and _differ(job, chosen, h)]
    rated = list(zip(here, map(float, _margins(job, chosen, here)), strict=True))
    # Another thing on the table that the part explains as well: which one is meant, no pixel
    # can tell.
    rated += [
        (h, 0.0)
        for h in found
        if h.search is not chosen.search
        and h.cost <= job.profile.max_cost
        and _differ(job, chosen, h)
    ]
    return sorted(rated, key=lambda pair: pair[1])


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
