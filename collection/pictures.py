"""Pictures of parts on the table, ray-cast without a screen or graphics card."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from reach.arrays import FloatArray
from reach.objects import GraspObject
from reach.raycast import RaycastScene
from reach.transforms import apply

Image = NDArray[np.uint8]

PART_COLOR = (236, 158, 58)
TABLE_COLOR = (226, 228, 232)
GRID_COLOR = (203, 206, 212)
BACKGROUND = (248, 248, 250)
GRID_PITCH = 0.01
"""Distance of the lines drawn on the table [m]."""
_LIGHT = np.array([0.35, -0.45, 0.82])
_LINE_WIDTH = 4e-4
_SAMPLES_PER_PIXEL = 2


@dataclass(frozen=True, slots=True)
class View:
    """Where the picture is taken from, looking at the part's middle.

    Args:
        azimuth: direction of the eye about world z, from world x [rad].
        elevation: of the eye over the table [rad].
        width: of the picture [pixel].
        height: of the picture [pixel].
    """

    azimuth: float = -1.05
    elevation: float = 0.55
    width: int = 320
    height: int = 240


def part_picture(obj: GraspObject, T_world_object: FloatArray, view: View | None = None) -> Image:
    """Picture of a part on the table z = 0, with grid lines every 10 mm.

    Args:
        obj: the part.
        T_world_object: how it lies, shape (4, 4).
        view: where from; parallel projection.

    Returns:
        RGB image, shape (height, width, 3).
    """
    view = view or View()
    vertices = apply(T_world_object, obj.vertices)
    scene = RaycastScene(vertices, obj.faces)
    origins, ahead = _rays(vertices, view)
    directions = np.broadcast_to(ahead, origins.shape)
    distance, face = scene.cast(origins, directions)

    color = _table_colors(origins, ahead, scene)
    hit = np.isfinite(distance)
    normals = obj.face_normals[face[hit]] @ T_world_object[:3, :3].T
    shade = 0.42 + 0.58 * np.clip(normals @ (_LIGHT / np.linalg.norm(_LIGHT)), 0, 1)
    color[hit] = np.array(PART_COLOR) * shade[:, None]
    fine = color.reshape(view.height, _SAMPLES_PER_PIXEL, view.width, _SAMPLES_PER_PIXEL, 3)
    image: Image = np.clip(fine.mean(axis=(1, 3)), 0, 255).astype(np.uint8)
    return image


def png_bytes(image: Image) -> bytes:
    """An image as a PNG file, for a web page or a file."""
    import io

    from PIL import Image as PillowImage

    buffer = io.BytesIO()
    picture: Any = PillowImage.fromarray(image)
    picture.save(buffer, format="PNG", optimize=True)
    return buffer.getvalue()


def _rays(vertices: FloatArray, view: View) -> tuple[FloatArray, FloatArray]:
    """Origins (N, 3) of parallel rays, row by row, and their common direction (3,)."""
    cos_e, sin_e = np.cos(view.elevation), np.sin(view.elevation)
    back = np.array([cos_e * np.cos(view.azimuth), cos_e * np.sin(view.azimuth), sin_e])
    right = np.array([-np.sin(view.azimuth), np.cos(view.azimuth), 0.0])
    up = np.cross(back, right)
    middle = 0.5 * (vertices.min(axis=0) + vertices.max(axis=0))
    spread = np.abs((vertices - middle) @ np.column_stack([right, up])).max(axis=0)
    scale = 1.18 * max(spread[0] / view.width, spread[1] / view.height) * 2
    columns = view.width * _SAMPLES_PER_PIXEL
    rows = view.height * _SAMPLES_PER_PIXEL
    u = (np.arange(columns) + 0.5) / _SAMPLES_PER_PIXEL - view.width / 2
    v = view.height / 2 - (np.arange(rows) + 0.5) / _SAMPLES_PER_PIXEL
    far = 2 * float(np.linalg.norm(np.ptp(vertices, axis=0)))
    grid_v, grid_u = np.meshgrid(v, u, indexing="ij")
    origins = (
        middle + far * back + scale * (grid_u.reshape(-1, 1) * right + grid_v.reshape(-1, 1) * up)
    )
    return origins, -back


def _table_colors(origins: FloatArray, ahead: FloatArray, scene: RaycastScene) -> FloatArray:
    """Color of the table along each ray, with grid and the part's shadow, shape (N, 3)."""
    color = np.tile(np.array(BACKGROUND, dtype=float), (len(origins), 1))
    if ahead[2] >= 0:
        return color
    points = origins - (origins[:, 2] / ahead[2])[:, None] * ahead
    color[:] = TABLE_COLOR
    off_line = np.abs((points[:, :2] / GRID_PITCH + 0.5) % 1.0 - 0.5) * GRID_PITCH
    color[(off_line < _LINE_WIDTH / 2).any(axis=1)] = GRID_COLOR
    light = np.broadcast_to(_LIGHT / np.linalg.norm(_LIGHT), points.shape)
    raised = points + np.array([0, 0, 1e-6])
    color[np.isfinite(scene.cast(raised, light)[0])] *= 0.72
    return color
