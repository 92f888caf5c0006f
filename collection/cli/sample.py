"""`reach sample`: grasps on one mesh."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Annotated, Any

import typer

if TYPE_CHECKING:
    from collection.sampling.over_poses import PoseSamples
    from reach.objects import GraspObject


def sample(
    mesh: Annotated[str, typer.Option(help="A mesh file or a built-in part's name.")],
    count: Annotated[int, typer.Option(min=1, help="Number of grasps.")] = 25,
    seed: Annotated[int, typer.Option(min=0, help="Everything random follows from it.")] = 0,
    mesh_unit: Annotated[str, typer.Option(help="Unit of the file: m, cm, mm or in.")] = "m",
    stable_pose: Annotated[
        int | None, typer.Option(min=0, help="Only on this stable pose; drawn if left out.")
    ] = None,
    min_probability: Annotated[
        float, typer.Option(min=0, max=1, help="Leave out less probable stable poses.")
    ] = 0.01,
    jitter: Annotated[
        bool, typer.Option(help="Move grasps on and around the part, as trials need.")
    ] = True,
    as_json: Annotated[
        bool, typer.Option("--json", help="Print JSON that `reach score --grasps` reads.")
    ] = False,
) -> None:
    """Sample antipodal grasps on a part, over the ways it can lie on a table.

    - `reach sample --mesh bracket --count 50 --seed 7`
    - `reach sample --mesh part.stl --mesh-unit mm --no-jitter --json > grasps.json`
    - `reach sample --mesh mug --stable-pose 0 --json`
    """
    from collection.objects import load_object
    from collection.objects.mesh_file import mesh_notes
    from collection.sampling import SamplingOptions
    from collection.sampling.over_poses import sample_over_poses
    from reach.gripper import ParallelJawGripper
    from reach.stable_poses import stable_poses

    part = load_object(mesh, mesh_unit)
    gripper = ParallelJawGripper.yumi()
    poses = stable_poses(part, min_probability)
    if stable_pose is not None:
        poses = (_chosen(part, stable_pose),)
    options = SamplingOptions() if jitter else SamplingOptions(jitter=0.0)
    samples = sample_over_poses(part, gripper, poses, count=count, seed=seed, options=options)
    notes = [*mesh_notes(part), *samples.notes]
    if as_json:
        document = grasp_file(part, samples, mesh, mesh_unit, gripper.name, seed)
        typer.echo(json.dumps(document | {"notes": notes}))
    else:
        _print_table(part, samples)
    for note in notes:
        typer.echo(f"note: {note}", err=True)


def grasp_file(
    part: GraspObject,
    samples: PoseSamples,
    mesh: str,
    mesh_unit: str,
    gripper: str,
    seed: int,
) -> dict[str, Any]:
    """The JSON document that `reach score --grasps` reads; SI units, poses as lists of rows."""
    return {
        "object": part.name,
        "mesh": mesh,
        "mesh_unit": mesh_unit,
        "gripper": gripper,
        "seed": seed,
        "grasps": [
            {
                "T_object_gripper": grasp.T_object_gripper.tolist(),
                "T_object_gripper_parent": grasp.T_object_gripper_parent.tolist(),
                "width": grasp.width,
                "contacts_object": grasp.contacts_object.tolist(),
                "approach_angle": grasp.approach_angle,
                "stable_pose": {
                    "index": pose.index,
                    "probability": pose.probability,
                    "T_world_object": pose.T_world_object.tolist(),
                },
            }
            for pose, grasp in samples.grasps
        ],
        "discarded": samples.discarded,
    }


def _chosen(part: GraspObject, index: int) -> Any:
    from collection.errors import PlanError
    from reach.stable_poses import stable_poses

    poses = stable_poses(part, 0.0)
    if index >= len(poses):
        raise PlanError(f"{part.name!r} has no stable pose {index}; valid: 0 to {len(poses) - 1}")
    return poses[index]


def _print_table(part: GraspObject, samples: PoseSamples) -> None:
    from collections import Counter

    from rich.console import Console
    from rich.table import Table

    table = Table(title=f"{part.name}: {len(samples.grasps)} grasps")
    for heading in ("pose", "probability", "grasps", "width mm", "approach deg"):
        table.add_column(heading, justify="right")
    counts = Counter(pose.index for pose, _ in samples.grasps)
    probabilities = {pose.index: pose.probability for pose, _ in samples.grasps}
    for index, number in sorted(counts.items()):
        own = [grasp for pose, grasp in samples.grasps if pose.index == index]
        widths = [grasp.width * 1e3 for grasp in own]
        angles = [grasp.approach_angle * 57.29578 for grasp in own]
        table.add_row(
            str(index),
            f"{probabilities[index]:.3f}",
            str(number),
            f"{min(widths):.1f} to {max(widths):.1f}",
            f"{min(angles):.0f} to {max(angles):.0f}",
        )
    console = Console()
    console.print(table)
    for reason, number in sorted(samples.discarded.items(), key=lambda item: -item[1]):
        console.print(f"discarded {number:6d}  {reason}")
