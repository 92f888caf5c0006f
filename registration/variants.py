"""The turns of a nearly symmetric part that look nearly like the pose that was found.

A search keeps few hypotheses, and those that differ. A lemon turned about its length, or a gear
turned by a tooth, hardly differs; yet it is another pose, and unless the image speaks against it
the part's place is not known. So such turns are sought on purpose, about the best pose.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from reach.arrays import FloatArray, IntArray
from reach.stable_poses import StablePose
from reach.symmetry import Symmetry
from reach.transforms import inverse
from registration.hypotheses import free_starts, planar_starts
from registration.job import Job
from registration.refine import refined
from registration.search import FREE, Hypothesis

POINTS = 80
"""Surface points by which poses are compared at first."""
SPACING = np.radians(9.0)
"""Variants nearer to each other, up to symmetry, are one: it slides to where it fits best [rad]."""
CLOSE, REFINED = 0.01, 2
"""So many variants are refined whose render cost is this close to the best pose's."""
MOST = 24
"""Variants that are aligned and rendered."""


def with_variants(job: Job, found: Sequence[Hypothesis], declared: int | None) -> list[Hypothesis]:
    """Hypotheses and the variants of the best one, by rising cost, those refined that may win.

    Args:
        job: the registration.
        found: refined hypotheses by rising cost, at least one.
        declared: index of the declared stable pose, None if there is none.
    """
    poses = job.poses
    if declared is not None and not job.options.check_other_poses:
        poses = tuple(pose for pose in poses if pose.index in (declared, found[0].stable_pose))
    added = _variants(job, found[0], poses)
    likely = [h for h in added if h.cost <= found[0].cost + CLOSE][:REFINED]
    added[: len(likely)] = [refined(job, h) for h in likely]
    return sorted([*found, *added], key=lambda hypothesis: hypothesis.cost)


def _variants(job: Job, best: Hypothesis, poses: Sequence[StablePose]) -> list[Hypothesis]:
    """Poses whose surfaces stay within `SensorProfile.distinct` of the best one's, aligned."""
    turned = job.options.max_turn_error
    search = best.search
    T_table_camera = inverse(search.T_camera_table())
    T_best = T_table_camera @ best.T_camera_object
    if best.stable_pose == FREE:
        starts = free_starts(job.obj.com)
        names = np.full(len(starts), FREE)
    else:
        starts = planar_starts(poses)
        names = np.repeat([pose.index for pose in poses], len(starts) // len(poses))
    starts = _moved_over(T_best, starts, job.obj.com, level=best.stable_pose != FREE)
    kept = _near(job, T_best, starts, turned)
    if len(kept) == 0:
        return []
    found = search.from_starts(starts[kept], names[kept], planar=best.stable_pose != FREE)
    return _spread(job.sym, best, found, turned)


def _moved_over(
    T_best: FloatArray, starts: FloatArray, com: FloatArray, *, level: bool
) -> FloatArray:
    """Starts (N, 4, 4) with their center of mass in, or with `level` above, the best pose's."""
    target = T_best[:3, :3] @ com + T_best[:3, 3]
    shift = target - ((starts[:, :3, :3] * com).sum(axis=2) + starts[:, :3, 3])
    if level:
        shift[:, 2] = 0.0
    moved = starts.copy()
    moved[:, :3, 3] += shift
    return moved


def _near(job: Job, T_best: FloatArray, starts: FloatArray, turned: float) -> IntArray:
    """Indices of turned starts whose surfaces stay near the best pose's, nearest first."""
    apart = job.model.surface_distances(T_best, starts, POINTS)
    near = np.flatnonzero(apart < job.profile.distinct)
    near = near[np.argsort(apart[near], kind="stable")]
    near = near[_turns(job.sym, T_best, starts[near]) > turned]
    return near[_apart(job.sym, starts[near], SPACING)]


def _spread(
    sym: Symmetry, best: Hypothesis, found: Sequence[Hypothesis], turned: float
) -> list[Hypothesis]:
    """Those that did not slide into the best hypothesis, nor into each other."""
    poses = np.stack([best.T_camera_object, *(h.T_camera_object for h in found)])
    return [found[i - 1] for i in _apart(sym, poses, turned) if i > 0]


def _apart(sym: Symmetry, T: FloatArray, turned: float) -> IntArray:
    """Indices of the first MOST poses (N, 4, 4) that are turned against all those before."""
    left = np.ones(len(T), bool)
    kept: list[int] = []
    while left.any() and len(kept) < MOST:
        kept.append(int(np.argmax(left)))
        left &= _turns(sym, T[kept[-1]], T) > turned
        left[kept[-1]] = False
    return np.array(kept, dtype=np.int64)


def _turns(sym: Symmetry, T: FloatArray, others: FloatArray) -> FloatArray:
    """Angles (N,) between a pose (4, 4) and others (N, 4, 4), up to symmetry [rad]."""
    if sym.sphere:
        return np.zeros(len(others))
    copies = T[:3, :3] @ sym.rotations
    if sym.axis is not None:
        cosine = (others[:, :3, :3] @ sym.axis) @ (copies @ sym.axis).T
    else:
        same = others[:, :3, :3].reshape(-1, 9) @ copies.reshape(-1, 9).T
        cosine = (same - 1.0) / 2.0
    angles: FloatArray = np.arccos(np.clip(cosine.max(axis=1), -1.0, 1.0))
    return angles
