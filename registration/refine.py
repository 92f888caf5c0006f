"""Bring the finalists to their best before they are compared.

Gauss-Newton on distances sees only where points lie, not what the camera would have seen of
the part besides: a handle at the rim of the silhouette moves the render cost long before it
moves a distance. A short pattern search on the render cost finds such turns.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from reach.arrays import FloatArray
from reach.transforms import exp
from registration.job import Job
from registration.polish import Polished, polish
from registration.resting import nearest_copy, nearest_stable_pose, stood_up
from registration.search import FREE, Hypothesis
from registration.support import Support

NEAR = 0.06
"""Hypotheses this close to the best render cost are refined."""
MOST = 4
TURNS = np.radians([1.0, 2.5, 6.0, 12.0])
SHIFT = 2.0
"""Slides tried, in units of the noise."""
ROUNDS = 3
PIXELS = 2000
"""Pixels of the part that the pattern search looks at, about."""
GAIN = 0.003
"""A pattern step must lower the render cost by this much to be worth leaving the fitted pose."""


def refine(job: Job, found: Sequence[Hypothesis], declared: int | None) -> list[Hypothesis]:
    """Refine the best hypotheses, and the best one of the declared stable pose.

    Args:
        job: the registration.
        found: hypotheses by rising cost.
        declared: index of the declared stable pose, None if there is none.

    Returns:
        All hypotheses by rising cost, those that may win refined.
    """
    chosen = [i for i, h in enumerate(found) if h.cost <= found[0].cost + NEAR][:MOST]
    own = [i for i, h in enumerate(found) if h.stable_pose == declared]
    if own and own[0] not in chosen:
        chosen.append(own[0])
    result = list(found)
    for i in chosen:
        result[i] = refined(job, found[i])
    return sorted(result, key=lambda hypothesis: hypothesis.cost)


def standing(job: Job, hypothesis: Hypothesis) -> Hypothesis:
    """A freely found pose set into the stable pose that it is close to, if it is to one."""
    T = hypothesis.T_camera_object
    index, tilt = nearest_stable_pose(T, job.table.normal_camera, job.poses, job.sym)
    if index is None or tilt > job.options.max_tilt:
        return hypothesis
    T = stood_up(
        T,
        job.table.normal_camera,
        job.table.offset_camera,
        job.poses[index],
        job.sym,
        job.model.hull_vertices,
    )
    cost = float(hypothesis.search.check(T[None]).cost[0])
    return replace(hypothesis, T_camera_object=T, stable_pose=index, cost=cost)


def refined(job: Job, start: Hypothesis) -> Hypothesis:
    """Refine one; a freely found pose may stand on the table after all, which then holds it."""
    moved = _improved(job, start)
    if start.stable_pose != FREE:
        return moved
    stood = standing(job, moved)
    if stood.stable_pose == FREE:
        return moved
    stood = _improved(job, replace(stood, polished=None))
    return stood if stood.cost < moved.cost + 0.01 else moved


def _improved(job: Job, start: Hypothesis) -> Hypothesis:
    fitted = _fitted(job, start)
    settled = _settle(fitted, job.table.normal_camera, job.obj.com, job.table.noise)
    if settled.cost > fitted.cost - GAIN:
        return fitted
    again = _fitted(job, settled)
    return again if again.cost < settled.cost else replace(settled, polished=again.polished)


def fit_of(job: Job, hypothesis: Hypothesis) -> Polished:
    """The hypothesis's exact fit, made now if it was not refined."""
    if hypothesis.polished is not None:
        return hypothesis.polished
    T = hypothesis.T_camera_object
    return polish(job.model, hypothesis.search.seen, T, _support(job, hypothesis), job.sym)


def _support(job: Job, hypothesis: Hypothesis) -> Support | None:
    if hypothesis.stable_pose == FREE:
        return None
    table = job.table
    up_ideal = job.poses[hypothesis.stable_pose].T_world_object[2, :3]
    up_object = hypothesis.T_camera_object[:3, :3].T @ table.normal_camera
    return Support(
        nearest_copy(up_ideal, up_object, job.sym),
        job.model.hull_vertices,
        table.normal_camera,
        table.offset_camera,
    )


def _fitted(job: Job, start: Hypothesis) -> Hypothesis:
    """The hypothesis at its exact fit, or where it was if the fit explains the image less."""
    fit = fit_of(job, replace(start, polished=None))
    cost = float(start.search.check(fit.T_camera_object[None]).cost[0])
    if cost > start.cost + 0.01:
        return replace(start, polished=fit)
    return replace(start, T_camera_object=fit.T_camera_object, cost=cost, polished=fit)


def _settle(start: Hypothesis, up_camera: FloatArray, com: FloatArray, noise: float) -> Hypothesis:
    """Pattern search of the render cost over turns and slides on the table."""
    search = start.search
    best = replace(start, cost=_coarse_cost(start))
    start = best
    for halvings in range(ROUNDS):
        shrink = 0.5**halvings
        T = _neighbors(best.T_camera_object, up_camera, com, shrink, SHIFT * noise * shrink)
        cost = search.check(T, PIXELS).cost
        least = int(np.argmin(cost))
        if cost[least] < best.cost - GAIN / 2:
            best = replace(best, T_camera_object=T[least], cost=float(cost[least]))
        elif best is start and halvings > 0:
            break
    if best is start:
        return best
    return replace(best, cost=float(search.check(best.T_camera_object[None]).cost[0]))


def _coarse_cost(hypothesis: Hypothesis) -> float:
    return float(hypothesis.search.check(hypothesis.T_camera_object[None], PIXELS).cost[0])


def _neighbors(
    T_camera_object: FloatArray, up_camera: FloatArray, com: FloatArray, shrink: float, shift: float
) -> FloatArray:
    """The pose turned about the vertical through its center of mass, or slid, (N, 4, 4)."""
    up = T_camera_object[:3, :3].T @ up_camera
    x = np.cross(up, np.eye(3)[np.argmin(np.abs(up))])
    x /= np.linalg.norm(x)
    y = np.cross(up, x)
    turns = [
        np.concatenate([angle * up, np.cross(com, angle * up)])
        for angle in np.concatenate([TURNS, -TURNS]) * shrink
    ]
    slides = [
        np.concatenate([np.zeros(3), way * shift * axis]) for axis in (x, y) for way in (1, -1)
    ]
    return np.stack([T_camera_object @ exp(xi) for xi in turns + slides])
