"""A picture of a registration: the depth image with the outlines of the pose and its rivals."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from reach.arrays import BoolArray, FloatArray
from reach.objects import GraspObject
from reach.transforms import inverse
from registration.embree import EmbreeMesh
from registration.errors import PictureError
from registration.frame import DepthFrame
from registration.result import Registration

CHOSEN = "#1acc33"
RIVALS = ("#f2331a", "#3d7dff", "#ff9e1a", "#c44dff", "#00b8b8")
"""Colors of rivals in turn, in the order in which the operator is asked about them."""
MARGIN = 60
"""Pixels shown around the part."""
SUFFIXES = (".png", ".jpg", ".svg", ".pdf")


def silhouette(mesh: EmbreeMesh, frame: DepthFrame, T_camera_object: FloatArray) -> BoolArray:
    """Pixels (H, W) of the image that a pose of the part covers."""
    T = inverse(T_camera_object)
    directions = frame.intrinsics.rays() @ T[:3, :3].T
    rays = np.empty((*directions.shape[:2], 6), np.float32)
    rays[..., :3], rays[..., 3:] = T[:3, 3], directions
    depth, _ = mesh.cast(rays.reshape(-1, 6))
    return np.asarray(np.isfinite(depth).reshape(directions.shape[:2]))


def check_picture(path: str | Path) -> Path:
    """Refuse a picture's name early.

    Raises:
        PictureError: unknown kind of picture.
    """
    path = Path(path)
    if path.suffix not in SUFFIXES:
        raise PictureError(f"cannot draw {path.name!r}; valid: {', '.join(SUFFIXES)}")
    return path


def save_picture(
    path: str | Path, obj: GraspObject, frame: DepthFrame, registration: Registration
) -> None:
    """Draw the depth image with the chosen pose's outline (green) and its rivals'.

    Rivals that are ruled out are left out; the others are numbered from 2, the chosen pose is 1.

    Raises:
        PictureError: unknown kind of picture, or the file cannot be written.
    """
    import matplotlib
    from matplotlib.figure import Figure

    path = check_picture(path)

    mesh = EmbreeMesh(obj)
    shown = silhouette(mesh, frame, registration.T_camera_object)
    T_camera_world = inverse(frame.T_world_camera)
    rivals = [
        silhouette(mesh, frame, T_camera_world @ rival.T_world_object)
        for rival in registration.rivals
        if not rival.ruled_out
    ]
    with matplotlib.rc_context({"svg.hashsalt": "reach"}):
        figure = Figure(figsize=(7, 6), layout="constrained")
        axes = figure.subplots()
        left, right, top, bottom = _window(shown)
        part = frame.depth[top:bottom, left:right] * 1e3
        image = axes.imshow(part, cmap="gray_r", extent=(left, right, bottom, top))
        figure.colorbar(image, ax=axes, label="depth [mm]")
        for number, outline in enumerate(rivals, start=2):
            _outline(axes, outline, RIVALS[(number - 2) % len(RIVALS)], "--", f"pose {number}")
        _outline(axes, shown, CHOSEN, "-", "pose 1")
        if rivals:
            axes.legend(loc="upper right", fontsize=9)
        axes.set_xlim(left, right)
        axes.set_ylim(bottom, top)
        axes.set_title(_title(obj, registration), fontsize=9)
        axes.set_xlabel("u [pixel]")
        axes.set_ylabel("v [pixel]")
        try:
            figure.savefig(path, dpi=130)
        except OSError as error:
            raise PictureError(f"cannot write {str(path)!r}: {error}") from error


def _outline(axes: Any, mask: BoolArray, color: str, style: str, name: str) -> None:
    if mask.any() and not mask.all():
        axes.contour(mask.astype(float), [0.5], colors=[color], linestyles=style, linewidths=1.2)
    axes.plot([], [], color=color, linestyle=style, label=name)


def _window(mask: BoolArray) -> tuple[int, int, int, int]:
    """Left, right, top and bottom of the picture around the part."""
    height, width = mask.shape
    rows, columns = np.nonzero(mask)
    if len(rows) == 0:
        return 0, width, 0, height
    return (
        max(0, int(columns.min()) - MARGIN),
        min(width, int(columns.max()) + MARGIN),
        max(0, int(rows.min()) - MARGIN),
        min(height, int(rows.max()) + MARGIN),
    )


def _title(obj: GraspObject, registration: Registration) -> str:
    standing = (
        "stands otherwise than declared"
        if registration.contradicts_declared
        else "ambiguous"
        if registration.ambiguous
        else "accepted"
    )
    return (
        f"{obj.name}: {standing}, stable pose {registration.stable_pose}, "
        f"cost {registration.render_cost:.3f}, margin {registration.margin:.2f}, "
        f"{sum(not rival.ruled_out for rival in registration.rivals)} rivals"
    )
