"""One part's share of a plan."""

from __future__ import annotations

from collections import Counter

from collection.objects.mesh_file import mesh_notes
from collection.plan.records import PlannedGrasp, PlannedObject, PlannedPose
from collection.sampling.options import SamplingOptions
from collection.sampling.over_poses import PoseSamples, sample_over_poses
from collection.sampling.sampler import Reachable
from reach.gripper import ParallelJawGripper
from reach.objects import GraspObject
from reach.stable_poses import StablePose, stable_poses


def plan_object(
    obj: GraspObject,
    gripper: ParallelJawGripper,
    *,
    count: int,
    seed: int,
    session: int,
    reachable: Reachable | None,
    options: SamplingOptions,
    min_probability: float,
) -> tuple[PlannedObject, tuple[PlannedGrasp, ...]]:
    """Plan one part's grasps.

    Args:
        obj: the part.
        gripper: the hand.
        count: number of grasps.
        seed: of this part in this session.
        session: goes into the grasps' identifiers.
        reachable: filter of the arm.
        options: limits of the search.
        min_probability: stable poses below it are left out.

    Raises:
        NoGraspError: no stable pose gives any grasp.
    """
    poses = stable_poses(obj, min_probability)
    samples = sample_over_poses(
        obj, gripper, poses, count=count, seed=seed, reachable=reachable, options=options
    )
    return _planned_object(obj, poses, samples), _planned_grasps(obj, samples, session)


def _planned_object(
    obj: GraspObject, poses: tuple[StablePose, ...], samples: PoseSamples
) -> PlannedObject:
    per_pose = Counter(pose.index for pose, _ in samples.grasps)
    return PlannedObject(
        name=obj.name,
        content_hash=obj.content_hash,
        faces=len(obj.faces),
        mass=obj.mass,
        poses=tuple(
            PlannedPose(
                index=pose.index,
                probability=pose.probability,
                T_world_object=pose.T_world_object,
                grasps=per_pose[pose.index],
            )
            for pose in poses
        ),
        notes=(*mesh_notes(obj), *samples.notes),
    )


def _planned_grasps(
    obj: GraspObject, samples: PoseSamples, session: int
) -> tuple[PlannedGrasp, ...]:
    return tuple(
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
        for number, (pose, grasp) in enumerate(samples.grasps)
    )
