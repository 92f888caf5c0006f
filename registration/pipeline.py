"""Find a known part in a depth image, know how well, and refuse when it cannot be known."""

from __future__ import annotations

from typing import Literal, get_args

import numpy as np

from reach.errors import InvalidInputError, UnknownNameError
from reach.objects import GraspObject
from reach.stable_poses import stable_poses
from registration.decision import Decision, decide
from registration.errors import NoGoodPoseError, TiltedPoseError
from registration.frame import DepthFrame
from registration.job import Job
from registration.options import RegistrationOptions
from registration.refine import fit_of, refine
from registration.resting import nearest_stable_pose
from registration.result import Registration, Rival, TableFit
from registration.search import FREE, Hypothesis
from registration.unobservable import unobservable_directions
from registration.variants import with_variants

Mode = Literal["declared", "any", "free"]
MODES: tuple[str, ...] = get_args(Mode)


def register(
    obj: GraspObject,
    frame: DepthFrame,
    *,
    stable_pose: int | None = None,
    mode: Mode = "declared",
    seed: int = 0,
    options: RegistrationOptions | None = None,
) -> Registration:
    """Find the pose of a known part that stands on a table.

    Args:
        obj: the part.
        frame: a depth image of it.
        stable_pose: index into `reach.stable_poses.stable_poses(obj)` that the operator was
            asked for; needed by the mode `declared`.
        mode: `declared` searches the declared stable pose (and, unless the options say
            otherwise, notices when another explains the image better), `any` all stable poses,
            `free` all orientations.
        seed: of the random draws; the same seed gives the same bits on any number of threads.
        options: thresholds and choices.

    Returns:
        The pose with its covariance, quality and rivals. Check `accepted` before using it.

    Raises:
        NoTableError: no level plane in the image.
        TooFewPointsError: nothing large enough stands on the table.
        NoGoodPoseError: no pose explains the image.
        TiltedPoseError: only a pose that leans against every stable pose does.
        InvalidInputError: unknown mode, or a stable pose that the part does not have.
    """
    options = options or RegistrationOptions()
    declared = _declared(obj, stable_pose, mode)
    job = Job(obj, frame, options, seed)
    found = _search(job, mode, declared)
    with job.timed("refine"):
        found = refine(job, found, declared)
    with job.timed("variants"):
        found = with_variants(job, found, declared)
    with job.timed("decide"):
        decision = decide(job, found, declared)
    return _report(job, decision, mode)


def _declared(obj: GraspObject, stable_pose: int | None, mode: str) -> int | None:
    if mode not in MODES:
        raise UnknownNameError("registration mode", mode, MODES)
    if mode != "declared":
        return None
    count = len(stable_poses(obj))
    if stable_pose is None or not 0 <= stable_pose < count:
        raise InvalidInputError(
            f"mode 'declared' needs a stable pose of {obj.name!r}, 0 to {count - 1}; "
            f"got {stable_pose!r}"
        )
    return stable_pose


def _search(job: Job, mode: str, declared: int | None) -> list[Hypothesis]:
    """Hypotheses by rising cost, the best of which explains the image.

    Raises:
        NoGoodPoseError: none does.
    """
    found: list[Hypothesis] = []
    if declared is not None:
        found += job.on_table([job.poses[declared]], "search")
        if job.options.check_other_poses or not _explains(job, found):
            others = [pose for pose in job.poses if pose.index != declared]
            found += job.on_table(others, "check other poses") if others else []
    elif mode == "any":
        found += job.on_table(job.poses, "search")
    if not _explains(job, found) and mode != "free":
        found += job.parted_components("part components")
    if not _explains(job, found):
        found += job.anywhere("search" if mode == "free" else "free search")
    found.sort(key=lambda hypothesis: hypothesis.cost)
    if not _explains(job, found):
        raise NoGoodPoseError(
            f"no pose of {job.obj.name!r} explains the image: the best render cost is "
            f"{found[0].cost:.2f}, at most {job.profile.max_cost:.2f} is accepted; "
            "wrong object, clutter, or a moved camera"
        )
    return found


def _explains(job: Job, found: list[Hypothesis]) -> bool:
    return any(hypothesis.cost <= job.profile.max_cost for hypothesis in found)


def _report(job: Job, decision: Decision, mode: str) -> Registration:
    chosen, up = decision.chosen, job.table.normal_camera
    polished = fit_of(job, chosen)
    T_camera_object = chosen.T_camera_object
    index, tilt = nearest_stable_pose(T_camera_object, up, job.poses, job.sym)
    if chosen.stable_pose == FREE:
        leaning = index is None or tilt > job.options.max_tilt
        if leaning and mode != "free":
            raise TiltedPoseError(
                f"{job.obj.name!r} stands {np.degrees(tilt):.0f} deg off its nearest stable pose "
                f"{index}, more than {np.degrees(job.options.max_tilt):.0f} deg"
            )
        stable_pose = None if leaning else index
    else:
        stable_pose = chosen.stable_pose
    check = chosen.search.check(T_camera_object[None])
    T_world_camera = job.frame.T_world_camera
    observed = float(check.observed_overlap[0])
    return Registration(
        T_camera_object=T_camera_object,
        T_world_object=T_world_camera @ T_camera_object,
        covariance=polished.covariance,
        stable_pose=stable_pose,
        fitness=polished.fitness,
        rmse=polished.rmse,
        observed_overlap=observed,
        model_overlap=float(check.model_overlap[0]),
        free_space_violation=float(check.free_space_violation[0]),
        unexplained=1.0 - observed,
        render_cost=float(check.cost[0]),
        margin=decision.margin,
        rivals=tuple(
            Rival(
                T_world_camera @ rival.hypothesis.T_camera_object,
                None if rival.hypothesis.stable_pose == FREE else rival.hypothesis.stable_pose,
                rival.hypothesis.cost,
                rival.margin,
                rival.log_odds,
                rival.ruled_out,
            )
            for rival in decision.rivals
        ),
        unobservable=unobservable_directions(
            polished.information, job.obj.com, job.obj.diameter / 2
        ),
        tilt=tilt,
        table=TableFit(
            job.table.normal_world, job.table.offset_world, job.table.rms, job.table.tilt
        ),
        ambiguous=decision.ambiguous,
        contradicts_declared=decision.contradicts_declared,
        seed=job.seed,
        timings=dict(job.timings),
    )
