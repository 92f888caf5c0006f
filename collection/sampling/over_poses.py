"""One part's grasps over the ways it can lie, drawn by probability."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from collection.errors import NoGraspError
from collection.sampling.options import SamplingOptions
from collection.sampling.sampler import Reachable, SampledGrasp, SampleResult, sample_grasps
from reach.gripper import ParallelJawGripper
from reach.objects import GraspObject
from reach.stable_poses import StablePose


@dataclass(frozen=True, slots=True, eq=False)
class PoseSamples:
    """Grasps with the stable pose of each, and what the search of each pose found.

    Args:
        grasps: sorted by pose, in the order found.
        searches: index of a pose -> result of its search; only poses that were drawn.
        notes: what the person who reads the plan should know.
    """

    grasps: tuple[tuple[StablePose, SampledGrasp], ...]
    searches: dict[int, SampleResult]
    notes: tuple[str, ...]

    @property
    def discarded(self) -> dict[str, int]:
        """Reason -> number of candidates, over all poses."""
        return _sum_discarded(self.searches.values())


def sample_over_poses(
    obj: GraspObject,
    gripper: ParallelJawGripper,
    poses: Sequence[StablePose],
    *,
    count: int,
    seed: int,
    reachable: Reachable | None = None,
    options: SamplingOptions | None = None,
) -> PoseSamples:
    """Draw a part's grasps over its stable poses.

    A pose that gives fewer grasps than drawn on it hands the rest on to the others, by their
    probability.

    Args:
        obj: the part.
        gripper: the hand.
        poses: how the part may lie.
        count: number of grasps.
        seed: everything random follows from it; a pose's grasps do not depend on other poses.
        reachable: filter of the arm.
        options: limits of the search.

    Raises:
        NoGraspError: no pose gives any grasp, or there is no pose.
    """
    if not poses:
        raise NoGraspError(f"{obj.name!r} has no stable pose as probable as asked for")
    searches: dict[int, SampleResult] = {}

    def found(pose: StablePose, number: int) -> int:
        known = searches.get(pose.index)
        if known is None or len(known.grasps) < number:
            searches[pose.index] = sample_grasps(
                obj,
                gripper,
                pose,
                count=number,
                rng=np.random.default_rng([seed, 1, pose.index]),
                reachable=reachable,
                options=options,
            )
        return len(searches[pose.index].grasps)

    rng = np.random.default_rng([seed, 0])
    wanted: Counter[int] = Counter()
    unused = {pose.index: pose for pose in poses}
    while wanted.total() < count and unused:
        wanted += _drawn(list(unused.values()), count - wanted.total(), rng)
        for pose in list(unused.values()):
            if wanted[pose.index] and found(pose, wanted[pose.index]) < wanted[pose.index]:
                wanted[pose.index] = len(searches[pose.index].grasps)
                del unused[pose.index]
    if not wanted.total():
        raise NoGraspError(_why_not(obj, gripper, searches))
    grasps = tuple(
        (pose, grasp)
        for pose in poses
        if pose.index in searches
        for grasp in searches[pose.index].grasps[: wanted[pose.index]]
    )
    return PoseSamples(grasps, searches, tuple(_notes(obj, poses, searches, len(grasps), count)))


def _drawn(poses: Sequence[StablePose], count: int, rng: np.random.Generator) -> Counter[int]:
    weights = np.array([pose.probability for pose in poses])
    drawn = rng.choice(len(poses), count, p=weights / weights.sum())
    return Counter(poses[int(i)].index for i in drawn)


def _notes(
    obj: GraspObject,
    poses: Sequence[StablePose],
    searches: dict[int, SampleResult],
    found: int,
    count: int,
) -> list[str]:
    notes = sorted({result.mesh_note for result in searches.values()} - {""})
    for pose in poses:
        result = searches.get(pose.index)
        if result is not None and not result.grasps:
            notes.append(
                f"{obj.name}: stable pose {pose.index} (probability {pose.probability:.2f}) is "
                f"left out, no grasp is left on it: {_main_reasons(result)}"
            )
    if found < count:
        notes.append(f"{obj.name}: only {found} of {count} different grasps were found")
    return notes


def _why_not(
    obj: GraspObject, gripper: ParallelJawGripper, searches: dict[int, SampleResult]
) -> str:
    candidates = sum(result.candidates for result in searches.values())
    total = SampleResult((), _sum_discarded(searches.values()), candidates)
    return (
        f"{gripper.name!r} (opening {gripper.max_opening * 1e3:.0f} mm) cannot hold {obj.name!r}: "
        f"of {candidates} candidates over {len(searches)} stable poses, {_main_reasons(total)}"
    )


def _sum_discarded(results: Iterable[SampleResult]) -> dict[str, int]:
    total: Counter[str] = Counter()
    for result in results:
        total.update(result.discarded)
    return dict(total)


def _main_reasons(result: SampleResult, most: int = 3) -> str:
    """The commonest reasons for discarding candidates, as one phrase."""
    ranked = Counter(result.discarded).most_common(most)
    return ", ".join(f"{100 * n / result.candidates:.0f} % {reason}" for reason, n in ranked)
