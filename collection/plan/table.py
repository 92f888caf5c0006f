"""A plan as tables, to be read before anything moves."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rich.table import Table

from collection.plan.records import Plan

if TYPE_CHECKING:
    from collections.abc import Iterable

    from reach.objects import GraspObject


def pose_table(plan: Plan, objects: Iterable[GraspObject]) -> Table:
    """Each part's stable poses: how likely, how many grasps, how to place the part."""
    from collection.plan.placing import how_it_lies

    by_name = {part.name: part for part in objects}
    parts = f"{len(plan.objects)} object{'s' * (len(plan.objects) > 1)}"
    table = Table(title=f"{len(plan.grasps)} grasps of {parts}", box=None)
    for heading in ("object", "pose", "%", "grasps", "how it lies"):
        table.add_column(heading, no_wrap=heading != "how it lies")
    for part in plan.objects:
        for pose in part.poses:
            table.add_row(
                part.name,
                str(pose.index),
                f"{100 * pose.probability:.0f}",
                str(pose.grasps),
                how_it_lies(by_name[part.name], pose),
            )
    return table


def trial_table(plan: Plan, most: int | None = None) -> Table:
    """The trials in their order, all or the first `most`."""
    shown = plan.trials[:most]
    table = Table(title=f"{len(shown)} of {len(plan.trials)} trials in order", box=None)
    for heading in ("trial", "object", "pose", "grasp", "repeat", "width mm", "approach deg"):
        table.add_column(heading, no_wrap=True)
    for trial in shown:
        grasp = plan.grasp(trial.grasp_id)
        table.add_row(
            str(trial.number),
            trial.object_name,
            str(grasp.stable_pose),
            grasp.grasp_id,
            str(trial.repeat),
            f"{grasp.width * 1e3:.1f}",
            f"{grasp.approach_angle * 57.29578:.0f}",
        )
    return table
