"""The plan of an experiment: which grasps are tried, how often, and in which order.

A plan is made before anything moves and follows from its seed alone. Each part's grasps depend
on that part, the seed and the session only, so that adding a part changes no other part's.
"""

from __future__ import annotations

import hashlib
import uuid
from collections.abc import Sequence

import numpy as np

from collection.errors import DuplicateNameError, PlanError
from collection.plan.one_object import plan_object
from collection.plan.records import Plan, PlannedGrasp, PlannedObject, PlannedTrial
from collection.sampling import Reachable, SamplingOptions
from reach.gripper import ParallelJawGripper
from reach.objects import GraspObject
from reach.stable_poses import MIN_PROBABILITY

__all__ = [
    "GRASPS_PER_OBJECT",
    "REPEATS",
    "Plan",
    "PlannedGrasp",
    "PlannedObject",
    "PlannedTrial",
    "make_plan",
    "repeat_plan",
]

GRASPS_PER_OBJECT = 25
REPEATS = 5
_TRIALS = uuid.uuid5(uuid.NAMESPACE_URL, "reach-trials/planned-trial")


def make_plan(
    objects: Sequence[GraspObject],
    gripper: ParallelJawGripper,
    *,
    grasps: int = GRASPS_PER_OBJECT,
    repeats: int = REPEATS,
    seed: int,
    session: int = 0,
    reachable: Reachable | None = None,
    options: SamplingOptions | None = None,
    min_probability: float = MIN_PROBABILITY,
    jobs: int = 1,
) -> Plan:
    """Plan an experiment, or a further session of one.

    Args:
        objects: the parts, each with its own name.
        gripper: the hand.
        grasps: how many of each part, over its stable poses.
        repeats: how often each grasp is tried.
        seed: everything random follows from it.
        session: 0, 1, ...: another number gives other grasps and trials of the same experiment.
        reachable: filter of the arm, see collection.sampling.Reachable.
        options: limits of the search for grasps.
        min_probability: stable poses below it are not planned on.
        jobs: processes that share the parts; the plan does not depend on it.

    Raises:
        DuplicateNameError: two parts have one name.
        NoGraspError: a part cannot be held.
        PlanError: nothing to plan.
    """
    _check(objects, grasps, repeats)
    options = options or SamplingOptions()
    from joblib import Parallel, delayed

    planned: list[tuple[PlannedObject, tuple[PlannedGrasp, ...]]] = Parallel(n_jobs=jobs)(
        delayed(plan_object)(
            obj,
            gripper,
            count=grasps,
            seed=_part_seed(seed, session, obj.name),
            session=session,
            reachable=reachable,
            options=options,
            min_probability=min_probability,
        )
        for obj in objects
    )
    all_grasps = tuple(grasp for _, of_part in planned for grasp in of_part)
    return Plan(
        seed=seed,
        session=session,
        gripper=gripper.name,
        options=options,
        objects=tuple(part for part, _ in planned),
        grasps=all_grasps,
        trials=_ordered_trials(all_grasps, range(repeats), seed, session),
    )


def repeat_plan(plan: Plan, repeats: int, *, seed: int, session: int) -> Plan:
    """Plan a further session that tries the grasps of a plan again.

    Args:
        plan: of the earlier session.
        repeats: how often each grasp is tried again; repeats count on from the plan's.
        seed: of the new order.
        session: number of the new session.

    Raises:
        PlanError: repeats is not positive, or the session's number is the plan's own.
    """
    if repeats < 1:
        raise PlanError(f"repeats is {repeats}, expected at least 1")
    if session <= plan.session:
        raise PlanError(f"session is {session}, expected more than the plan's {plan.session}")
    first = 1 + max(trial.repeat for trial in plan.trials)
    trials = _ordered_trials(plan.grasps, range(first, first + repeats), seed, session)
    # Not model_copy: it would carry the old plan's cached hash along.
    return Plan(
        seed=seed,
        session=session,
        gripper=plan.gripper,
        options=plan.options,
        objects=plan.objects,
        grasps=plan.grasps,
        trials=trials,
    )


def _check(objects: Sequence[GraspObject], grasps: int, repeats: int) -> None:
    if not objects:
        raise PlanError("no objects to plan for")
    if grasps < 1 or repeats < 1:
        raise PlanError(f"grasps is {grasps} and repeats is {repeats}, expected at least 1 each")
    names = [obj.name for obj in objects]
    for name in names:
        if names.count(name) > 1:
            raise DuplicateNameError(f"two objects are called {name!r}")


def _part_seed(seed: int, session: int, name: str) -> int:
    digest = hashlib.sha256(f"{seed}/{session}/{name}".encode()).digest()
    return int.from_bytes(digest[:16], "big")


def _ordered_trials(
    grasps: Sequence[PlannedGrasp], repeats: range, seed: int, session: int
) -> tuple[PlannedTrial, ...]:
    """All trials in random order, balanced over parts and over repeats.

    A part's trials are rounds, each with all its grasps once in random order. The k-th of a
    part's n trials gets the place (k + U(0, 1)) / n of the session: every stretch of the session
    holds its share of every part, so that no drift of the station looks like a part's trait.
    """
    rng = np.random.default_rng(_part_seed(seed, session, "order of trials"))
    names = list(dict.fromkeys(grasp.object_name for grasp in grasps))
    placed: list[tuple[float, PlannedGrasp, int]] = []
    for name in names:
        own = [grasp for grasp in grasps if grasp.object_name == name]
        sequence = [(own[int(i)], repeat) for repeat in repeats for i in rng.permutation(len(own))]
        places = (np.arange(len(sequence)) + rng.random(len(sequence))) / len(sequence)
        placed += [(float(p), *trial) for p, trial in zip(places, sequence, strict=True)]
    placed.sort(key=lambda entry: entry[0])
    return tuple(
        PlannedTrial(
            number=number,
            trial_id=str(uuid.uuid5(_TRIALS, f"{seed}/{session}/{grasp.grasp_id}/{repeat}")),
            grasp_id=grasp.grasp_id,
            object_name=grasp.object_name,
            repeat=repeat,
        )
        for number, (_, grasp, repeat) in enumerate(placed, start=1)
    )
