"""One part's grasps: stable poses drawn by probability, grasps sampled on each."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, field

import numpy as np

from collection.errors import NoGraspError
from collection.plan_records import PlannedGrasp, PlannedObject, PlannedPose
from collection.sampling import (
    Reachable,
    SampledGrasp,
    SampleResult,
    SamplingOptions,
    sample_grasps,
)
from reach.gripper import ParallelJawGripper
from reach.objects import GraspObject
from reach.stable_poses import StablePose, stable_poses


def plan_object(
    obj: GraspObject,
    gripper: ParallelJawGripper,
    *,
    count: int,
    seed: int,
    session: int = 0,
    reachable: Reachable | None = None,
    options: SamplingOptions | None = None,
) -> tuple[PlannedObject, tuple[PlannedGrasp, ...]]:
    """Draw a part's grasps over its stable poses.

    A pose that gives fewer grasps than drawn on it hands the rest to the others, by their
    probability.

    Args:
        obj: the part.
        gripper: the hand.
        count: number of grasps.
        seed: everything random follows from it.
        session: goes into the grasps' identifiers.
        reachable: filter of the arm.
        options: limits of the search.

    Raises:
        NoGraspError: no stable pose gives any grasp.
    """
    poses = stable_poses(obj)
    search = _PoseSearch(obj, gripper, seed, reachable, options or SamplingOptions())
    wanted: Counter[int] = Counter()
    rng = np.random.default_rng([seed, 0])
    open_poses = list(poses)
    while wanted.total() < count and open_poses:
        weights = np.array([pose.probability for pose in open_poses])
        drawn = rng.choice(len(open_poses), count - wanted.total(), p=weights / weights.sum())
        for i, times in Counter(drawn.tolist()).items():
            wanted[open_poses[i].index] += times
        for pose in list(open_poses):
            found = search.at_most(pose, wanted[pose.index])
            if found < wanted[pose.index]:
                wanted[pose.index] = found
                open_poses.remove(pose)
    if not wanted.total():
        raise NoGraspError(_why_not(obj, gripper, search.results))
    return _records(obj, poses, wanted, search, count, session)


@dataclass
class _PoseSearch:
    """Samples each pose as far as asked; the same pose and seed always give the same grasps."""

    obj: GraspObject
    gripper: ParallelJawGripper
    seed: int
    reachable: Reachable | None
    options: SamplingOptions
    results: dict[int, SampleResult] = field(default_factory=dict)

    def at_most(self, pose: StablePose, count: int) -> int:
        """How many of the wanted grasps a pose gives."""
        if count and (pose.index not in self.results or len(self.grasps(pose.index)) < count):
            self.results[pose.index] = sample_grasps(
                self.obj,
                self.gripper,
                pose,
                count=count,
                rng=np.random.default_rng([self.seed, 1, pose.index]),
                reachable=self.reachable,
                options=self.options,
            )
        return min(count, len(self.grasps(pose.index)))

    def grasps(self, index: int) -> tuple[SampledGrasp, ...]:
        return self.results[index].grasps if index in self.results else ()


def _records(
    obj: GraspObject,
    poses: tuple[StablePose, ...],
    wanted: Counter[int],
    search: _PoseSearch,
    count: int,
    session: int,
) -> tuple[PlannedObject, tuple[PlannedGrasp, ...]]:
    chosen = [
        (pose, grasp) for pose in poses for grasp in search.grasps(pose.index)[: wanted[pose.index]]
    ]
    grasps = tuple(
        PlannedGrasp(
            grasp_id=f"{obj.name}-s{session}-g{number:03d}",
            object_name=obj.name,
            stable_pose=pose.index,
            T_object_gripper=grasp.T_object_gripper,
            T_object_gripper_parent=grasp.T_object_gripper_parent,
            width=grasp.width,
            approach_angle=grasp.approach_angle,
            contacts_object=grasp.contacts_object.tolist(),
        )
        for number, (pose, grasp) in enumerate(chosen)
    )
    part = PlannedObject(
        name=obj.name,
        content_hash=obj.content_hash,
        faces=len(obj.faces),
        mass=obj.mass,
        poses=tuple(
            PlannedPose(
                index=pose.index,
                probability=pose.probability,
                T_world_object=pose.T_world_object,
                grasps=wanted[pose.index],
            )
            for pose in poses
        ),
        notes=tuple(_notes(obj, poses, search, len(chosen), count)),
    )
    return part, grasps


def _notes(
    obj: GraspObject,
    poses: tuple[StablePose, ...],
    search: _PoseSearch,
    found: int,
    count: int,
) -> list[str]:
    """What the person who reads the plan should know."""
    notes = sorted({result.mesh_note for result in search.results.values()} - {""})
    for pose in poses:
        result = search.results.get(pose.index)
        if result is not None and not result.grasps:
            notes.append(
                f"{obj.name}: stable pose {pose.index} (probability {pose.probability:.2f}) is "
                f"left out, no grasp is left on it: {main_reasons(result)}"
            )
    if found < count:
        notes.append(f"{obj.name}: only {found} of {count} different grasps were found")
    return notes


def main_reasons(result: SampleResult, most: int = 3) -> str:
    """The commonest reasons for discarding candidates, as one phrase."""
    ranked = Counter(result.discarded).most_common(most)
    return ", ".join(f"{100 * n / result.candidates:.0f} % {reason}" for reason, n in ranked)


def _why_not(
    obj: GraspObject, gripper: ParallelJawGripper, results: dict[int, SampleResult]
) -> str:
    discarded: Counter[str] = Counter()
    for result in results.values():
        discarded += Counter(result.discarded)
    candidates = sum(result.candidates for result in results.values())
    total = SampleResult((), dict(discarded), candidates)
    return (
        f"nobody can hold {obj.name!r} with gripper {gripper.name!r} "
        f"(opening {gripper.max_opening * 1e3:.0f} mm): of {candidates} candidates over "
        f"{len(results)} stable poses, {main_reasons(total)}"
    )
