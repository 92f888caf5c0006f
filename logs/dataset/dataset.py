"""The labeled data set as a value: objects, gripper, and one row per trial that counts.

It is made from recorded sessions ([logs.dataset.from_session][]) or imported files
([logs.export.reach2019][]), lies on disk as a folder ([logs.dataset.files][]), and answers what
evaluation needs ([Dataset.cases][]).
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from logs.dataset.labeled_trial import LabeledTrial, LeftOut
from logs.errors import DatasetError
from reach.errors import UnknownNameError
from reach.gripper import ParallelJawGripper
from reach.objects import GraspObject

if TYPE_CHECKING:
    from reach.evaluation.cases import GraspCase

SUCCESS_RULE = (
    "Success: clear of the table by 50 mm and still held after 1 s; turning in the grasp counts as "
    "success and is marked rotated."
)
"""The rule of this project's own trials."""


@dataclass(frozen=True, slots=True)
class StatedPoseError:
    """Standard deviations of the object's pose in the hand, and where the numbers are from.

    Args:
        translation: along each axis [m].
        rotation: about each axis [rad].
        basis: where it comes from, one sentence.
    """

    translation: float
    rotation: float
    basis: str


@dataclass(frozen=True, slots=True, eq=False)
class Dataset:
    """Labeled grasp trials of one gripper on known objects.

    Args:
        name: of the data set.
        origin: one sentence for the card: where the trials are from.
        objects: name -> object.
        mass_sources: name -> where the mass is from.
        gripper: the hand of all trials.
        trials: those that count, in executed order.
        left_out: planned trials that do not count.
        pose_error: what the data's station states; None if nothing is known.
        license: of the data, None if nobody stated one.
        notes: what a user of the data should know: repairs, projections, renamed grasps.
        success_rule: what the labels mean.
    """

    name: str
    origin: str
    objects: Mapping[str, GraspObject]
    mass_sources: Mapping[str, str]
    gripper: ParallelJawGripper
    trials: tuple[LabeledTrial, ...]
    left_out: tuple[LeftOut, ...] = ()
    pose_error: StatedPoseError | None = None
    license: str | None = None
    notes: tuple[str, ...] = ()
    success_rule: str = SUCCESS_RULE

    def __post_init__(self) -> None:
        unknown = {trial.object_name for trial in self.trials} - set(self.objects)
        if unknown:
            raise UnknownNameError("object of a trial", sorted(unknown)[0], self.objects)
        if len({trial.trial_id for trial in self.trials}) != len(self.trials):
            raise DatasetError(f"data set {self.name!r} holds a trial id twice")

    @property
    def simulated(self) -> bool:
        """Whether any of its trials was simulated."""
        return any(trial.simulated for trial in self.trials)

    @property
    def successes(self) -> int:
        """Number of trials that ended stably lifted."""
        return sum(trial.label.success for trial in self.trials)

    def by_object(self) -> dict[str, list[LabeledTrial]]:
        """Trials of each object that has any, objects by name."""
        result: dict[str, list[LabeledTrial]] = {}
        for trial in sorted(self.trials, key=lambda trial: trial.object_name):
            result.setdefault(trial.object_name, []).append(trial)
        return result

    def by_grasp(self) -> dict[str, list[LabeledTrial]]:
        """Trials of each planned grasp: objects by name, grasps by attempt, then by repeat."""
        ordered = sorted(
            self.trials, key=lambda t: (t.object_name, t.attempt, t.grasp_id, t.repeat)
        )
        result: dict[str, list[LabeledTrial]] = {}
        for trial in ordered:
            result.setdefault(trial.grasp_id, []).append(trial)
        return result

    def cases(self) -> tuple[GraspCase, ...]:
        """Its grasps with their labels, for evaluation; the planned pose is what is scored."""
        from reach.evaluation.cases import GraspCase
        from reach.grasp import Grasp
        from reach.scene import Scene

        cases = []
        for grasp_id, trials in self.by_grasp().items():
            first = trials[0]
            scene = Scene(
                self.objects[first.object_name],
                self.gripper,
                first.T_world_object,
                first.table_height,
            )
            grasp = Grasp(first.T_object_gripper, first.opening, first.force)
            lifted = sum(trial.label.success for trial in trials)
            cases.append(GraspCase(first.object_name, grasp_id, scene, grasp, lifted, len(trials)))
        return tuple(cases)


def merge(datasets: Sequence[Dataset]) -> Dataset:
    """Join data sets into one.

    Raises:
        DatasetError: nothing to join, different grippers, or one name for two geometries.
    """
    if not datasets:
        raise DatasetError("no data set given")
    if len(datasets) == 1:
        return datasets[0]
    first, datasets = datasets[0], _with_distinct_grasps(datasets)
    objects: dict[str, GraspObject] = {}
    for one in datasets:
        if one.gripper.name != first.gripper.name:
            raise DatasetError(
                f"gripper {one.gripper.name!r} of {one.name!r} is not {first.gripper.name!r} "
                f"of {first.name!r}: evaluate them apart"
            )
        for name, part in one.objects.items():
            known = objects.setdefault(name, part)
            if known.content_hash != part.content_hash or known.mass != part.mass:
                raise DatasetError(_two_of_one_name(known, part, one.name))
    return replace(
        first,
        name="+".join(dict.fromkeys(one.name for one in datasets)),
        origin=" ".join(dict.fromkeys(one.origin for one in datasets)),
        objects=objects,
        mass_sources={k: v for one in datasets for k, v in one.mass_sources.items()},
        trials=tuple(trial for one in datasets for trial in one.trials),
        left_out=tuple(row for one in datasets for row in one.left_out),
        pose_error=_joint_pose_error(datasets),
        license=first.license if len({one.license for one in datasets}) == 1 else None,
        notes=tuple(dict.fromkeys(note for one in datasets for note in one.notes)),
        success_rule=" ".join(dict.fromkeys(one.success_rule for one in datasets)),
    )


def _two_of_one_name(known: GraspObject, part: GraspObject, source: str) -> str:
    differs = f"mass {part.mass * 1e3:.4g} g instead of {known.mass * 1e3:.4g} g"
    if known.content_hash != part.content_hash:
        differs = f"another shape, {_sizes(part)} instead of {_sizes(known)}, or another {differs}"
        if known.mass == part.mass:
            differs = f"another shape, {_sizes(part)} instead of {_sizes(known)}"
    return (
        f"object {part.name!r} of {source!r} has {differs}: evaluate the sets apart, or import or "
        "record it under a name of its own"
    )


def _sizes(part: GraspObject) -> str:
    extents = (part.vertices.max(axis=0) - part.vertices.min(axis=0)) * 1e3
    size = " x ".join(f"{extent:.4g}" for extent in extents)
    return f"{size} mm of {len(part.faces)} faces"


def _joint_pose_error(datasets: Sequence[Dataset]) -> StatedPoseError | None:
    """Root mean square over the data sets that state one, weighted by their trials."""
    stated = [(one.pose_error, len(one.trials)) for one in datasets if one.pose_error]
    total = sum(count for _, count in stated)
    if not total:
        return None
    translation = sum(e.translation**2 * n for e, n in stated) / total
    rotation = sum(e.rotation**2 * n for e, n in stated) / total
    basis = "; ".join(dict.fromkeys(e.basis for e, _ in stated))
    return StatedPoseError(translation**0.5, rotation**0.5, basis)


def _with_distinct_grasps(datasets: Sequence[Dataset]) -> list[Dataset]:
    """Rename a grasp id that stands for different planned grasps in different data sets.

    Sessions of one plan share their grasps; those of different plans may share mere names.
    """
    planned: dict[str, set[bytes]] = {}
    for trial in (trial for one in datasets for trial in one.trials):
        planned.setdefault(trial.grasp_id, set()).add(trial.T_object_gripper.tobytes())
    clashing = {grasp_id for grasp_id, poses in planned.items() if len(poses) > 1}
    return [
        replace(
            one,
            trials=tuple(
                replace(trial, grasp_id=f"{trial.grasp_id}@{trial.session}")
                if trial.grasp_id in clashing
                else trial
                for trial in one.trials
            ),
        )
        for one in datasets
    ]


def refuse_empty(dataset: Dataset) -> None:
    """Refuse a data set in which no trial counts.

    Raises:
        DatasetError: saying why the planned ones do not.
    """
    if not dataset.trials:
        counts = Counter(row.reason for row in dataset.left_out)
        reasons = ", ".join(f"{count} {reason}" for reason, count in sorted(counts.items()))
        raise DatasetError(
            f"{dataset.name!r} holds no trial that counts; left out: {reasons or 'none'}"
        )
