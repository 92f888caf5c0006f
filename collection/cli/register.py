"""`reach register`: where is the part in this depth image?"""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

if TYPE_CHECKING:
    from reach.objects import GraspObject
    from registration.frame import DepthFrame
    from registration.result import Registration

FARTHEST = 20.0
"""No depth camera sees a table from further away [m]."""


def register(
    mesh: Annotated[str, typer.Option(help="A mesh file or a built-in part's name.")],
    cloud: Annotated[Path, typer.Option(help="A .npz depth frame, or a .ply or .pcd cloud.")],
    camera: Annotated[
        Path | None,
        typer.Option(help="JSON with intrinsics and T_world_camera; a cloud needs it."),
    ] = None,
    stable_pose: Annotated[
        int | None, typer.Option(min=0, help="Stable pose that the part was put down in.")
    ] = None,
    mode: Annotated[
        str | None,
        typer.Option(help="declared, any or free; declared if --stable-pose is given, else any."),
    ] = None,
    sensor: Annotated[
        str | None,
        typer.Option(help="structured-light or stereo; structured-light if no file says."),
    ] = None,
    mesh_unit: Annotated[str, typer.Option(help="Unit of the mesh: m, cm, mm or in.")] = "m",
    seed: Annotated[int, typer.Option(min=0, help="Everything random follows from it.")] = 0,
    picture: Annotated[
        Path | None, typer.Option(help="Draw the pose and its rivals over the image (.png).")
    ] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print JSON.")] = False,
) -> None:
    """Find a part in a depth image: its pose, how well it is known, and what else it could be.

    A `.npz` frame holds `depth` (H, W) [m], 0 or NaN without a return, `intrinsics`
    (fx, fy, cx, cy), and may hold `T_world_camera` (4, 4). A `.ply` or `.pcd` cloud comes with a
    camera file: `{"intrinsics": {"width": 640, "height": 480, "fx": 860, "fy": 860, "cx": 319.5,
    "cy": 239.5}, "T_world_camera": [[..], [..], [..], [0, 0, 0, 1]], "cloud_frame": "camera",
    "unit": "m", "sensor": "stereo"}`; the world's z points up.

    - `reach register --mesh bracket --cloud frame.npz --stable-pose 1 --json`
    - `reach register --mesh part.stl --mesh-unit mm --cloud scan.ply --camera camera.json`
    - `reach register --mesh mug --cloud frame.npz --mode free --picture overlay.png`
    """
    from collection.cloud_file import read_cloud
    from collection.objects import load_object
    from collection.targets import check_files
    from registration import register as find
    from registration.picture import check_picture, save_picture

    if picture is not None:
        check_picture(picture)
    check_files([picture])
    part = load_object(mesh, mesh_unit)
    frame = read_cloud(cloud, camera, sensor)
    _check_unit(cloud, frame)
    chosen_mode: Any = mode or ("any" if stable_pose is None else "declared")
    found = find(part, frame, stable_pose=stable_pose, mode=chosen_mode, seed=seed)
    if picture is not None:
        save_picture(picture, part, frame, found)
    if as_json:
        typer.echo(json.dumps(registration_json(part, found)))
    else:
        _print(part, found)


def _check_unit(cloud: Path, frame: DepthFrame) -> None:
    """Refuse depths that can only be millimeters, before they are taken for an empty table."""
    import numpy as np

    from registration.errors import CloudFileError

    if not np.isfinite(frame.depth).any():
        raise CloudFileError(f"{cloud.name!r} holds no depth at all")
    depth = float(np.nanmedian(frame.depth))
    if depth > FARTHEST:
        remedy = (
            "divide its depths by 1000"
            if cloud.suffix == ".npz"
            else 'say "unit": "mm" in the camera file'
        )
        raise CloudFileError(
            f"{cloud.name!r} read in m is {depth:.0f} m away; it is probably in millimeters: {remedy}"
        )


def registration_json(part: GraspObject, found: Registration) -> dict[str, Any]:
    """A registration as plain JSON values, SI units, row-major matrices."""
    return {
        "object": part.name,
        "accepted": found.accepted,
        "ambiguous": found.ambiguous,
        "contradicts_declared": found.contradicts_declared,
        "T_camera_object": found.T_camera_object.tolist(),
        "T_world_object": found.T_world_object.tolist(),
        "covariance": found.covariance.tolist(),
        "stable_pose": found.stable_pose,
        "fitness": found.fitness,
        "rmse": found.rmse,
        "observed_overlap": found.observed_overlap,
        "model_overlap": found.model_overlap,
        "free_space_violation": found.free_space_violation,
        "unexplained": found.unexplained,
        "render_cost": found.render_cost,
        "margin": found.margin,
        "rivals": [
            {
                "T_world_object": rival.T_world_object.tolist(),
                "stable_pose": rival.stable_pose,
                "render_cost": rival.render_cost,
                "margin": rival.margin,
                "log_odds": rival.log_odds,
                "ruled_out": rival.ruled_out,
            }
            for rival in found.rivals
        ],
        "unobservable": list(found.unobservable),
        "tilt": None if found.stable_pose is None else found.tilt,
        "table": {
            "normal": found.table.normal.tolist(),
            "offset": found.table.offset,
            "rms": found.table.rms,
            "tilt": found.table.tilt,
        },
        "seed": found.seed,
        "timings": dict(found.timings),
    }


def _print(part: GraspObject, found: Registration) -> None:
    import numpy as np

    from reach.pose_error import PoseError

    verdict = (
        "stands otherwise than declared"
        if found.contradicts_declared
        else "ambiguous: ask, or place it again"
        if found.ambiguous
        else "accepted"
    )
    spread = np.sqrt(np.diag(PoseError(found.covariance).without_free_turns().covariance))
    typer.echo(f"{part.name}: {verdict}, stable pose {found.stable_pose}")
    typer.echo(f"render cost {found.render_cost:.3f}, margin {found.margin:.2f}")
    typer.echo("T_world_object:")
    for row in found.T_world_object:
        typer.echo("  " + " ".join(f"{value:10.6f}" for value in row))
    turn, shift = np.degrees(spread[:3]), 1e3 * spread[3:]
    typer.echo(f"standard deviations: {_triple(turn)} deg, {_triple(shift)} mm (object's axes)")
    for direction in found.unobservable:
        typer.echo(f"not observable: {direction}")
    for rival in found.rivals:
        typer.echo(
            f"rival: stable pose {rival.stable_pose}, cost {rival.render_cost:.3f}, "
            f"evidence against it {rival.margin:.2f}"
        )


def _triple(values: Any) -> str:
    return " ".join(f"{value:.3f}" for value in values)
