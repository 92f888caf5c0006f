"""Pictures of an object without a screen: rays cast at its mesh, shaded, as PNG bytes."""

from __future__ import annotations

import base64
import io
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from reach.arrays import FloatArray, IntArray
from reach.objects import GraspObject
from reach.raycast import RaycastScene
from reach.transforms import apply, inverse

VIEW_AZIMUTH, VIEW_ELEVATION = np.radians(-55.0), np.radians(28.0)
SMOOTH_BELOW = np.radians(30.0)
"""Faces that meet at a smaller angle are shaded as one round surface."""
SUPERSAMPLING = 2
NEUTRAL = (0.62, 0.67, 0.74)

Colors = Callable[[FloatArray, FloatArray], FloatArray]
"""Points (N, 3) and outward normals (N, 3), object frame, to colors (N, 3) in [0, 1]."""


@dataclass(frozen=True, slots=True, eq=False)
class Solid:
    """A triangle mesh in the world with its color.

    Args:
        vertices: shape (V, 3), world [m].
        faces: shape (F, 3).
        normals: at the faces' corners, shape (F, 3, 3), world, outward.
        color: one color (3,) in [0, 1], or a function of points and normals in the world.
        opacity: 1 hides what is behind.
    """

    vertices: FloatArray
    faces: IntArray
    normals: FloatArray
    color: tuple[float, float, float] | Colors
    opacity: float = 1.0


def object_solid(
    part: GraspObject,
    T_world_object: FloatArray,
    color: tuple[float, float, float] | Colors = NEUTRAL,
) -> Solid:
    """The object at a pose; a function of color is asked in the object's frame."""
    rotation = T_world_object[:3, :3]
    normals = corner_normals(part) @ rotation.T
    paint = color
    if callable(color):
        T_object_world = inverse(T_world_object)
        inner = color

        def paint(points: FloatArray, normals: FloatArray) -> FloatArray:
            return inner(apply(T_object_world, points), normals @ rotation)

    return Solid(apply(T_world_object, part.vertices), part.faces, normals, paint)


def plate_solid(
    corners: FloatArray, thickness: float, color: tuple[float, float, float], opacity: float
) -> Solid:
    """A convex plate: corners (N, 3) counter-clockwise about its direction of thickness."""
    count = len(corners)
    out = np.cross(corners[1] - corners[0], corners[2] - corners[0])
    out *= thickness / np.linalg.norm(out)
    vertices = np.concatenate([corners, corners + out])
    fan = [(0, i + 1, i) for i in range(1, count - 1)]
    lid = [(count, count + i, count + i + 1) for i in range(1, count - 1)]
    ring = [(i, (i + 1) % count, count + i) for i in range(count)]
    ring += [((i + 1) % count, count + (i + 1) % count, count + i) for i in range(count)]
    faces = np.array(fan + lid + ring)
    return Solid(vertices, faces, _flat_normals(vertices, faces), color, opacity)


def render(
    solids: Sequence[Solid],
    size: tuple[int, int] = (360, 300),
    *,
    focus: FloatArray | None = None,
    azimuth: float = VIEW_AZIMUTH,
    elevation: float = VIEW_ELEVATION,
) -> bytes:
    """Shade solids in an orthographic view from above, on a transparent ground.

    Args:
        solids: at least one; the first one is framed if there is no focus.
        size: width and height of the picture [pixels].
        focus: points (N, 3) that the picture frames, world [m].
        azimuth: direction of the camera about world z [rad].
        elevation: of the camera above the horizon [rad].

    Returns:
        A PNG file.
    """
    from PIL import Image

    width, height = (SUPERSAMPLING * n for n in size)
    right, up, ahead = _camera(azimuth, elevation)
    framed = solids[0].vertices if focus is None else focus
    origins = _pixels(framed, right, up, ahead, width, height)
    picture = np.zeros((height * width, 4))
    layers = [_layer(solid, origins, ahead, up) for solid in solids]
    depths = np.stack([depth for _, depth in layers])
    for index in np.argsort(-depths, axis=0, kind="stable"):
        for k, (color, depth) in enumerate(layers):
            seen = (index == k) & np.isfinite(depth)
            _blend(picture, seen, color, solids[k].opacity)
    image = picture.reshape(height, width, 4)
    image = image.reshape(size[1], SUPERSAMPLING, size[0], SUPERSAMPLING, 4)
    alpha = image[..., 3:].mean(axis=(1, 3))
    flat = (image[..., :3] * image[..., 3:]).mean(axis=(1, 3))
    rgb = np.divide(flat, alpha, out=np.zeros_like(flat), where=alpha > 0)
    out = np.concatenate([rgb, alpha], axis=-1)
    stream = io.BytesIO()
    Image.fromarray((255 * out.clip(0, 1)).round().astype(np.uint8), "RGBA").save(
        stream, "PNG", optimize=False
    )
    return stream.getvalue()


def data_uri(png: bytes) -> str:
    """The picture as a `data:` address, for a page that stands alone."""
    return "data:image/png;base64," + base64.b64encode(png).decode()


def corner_normals(part: GraspObject) -> FloatArray:
    """Normals at the faces' corners, shape (F, 3, 3): smooth over round parts, sharp at edges.

    A corner's normal is the area-weighted mean of the normals of all faces at its vertex that
    are within the smoothing angle of its own face.
    """
    normals = part.face_normals
    t = part.triangles
    areas = np.linalg.norm(np.cross(t[:, 1] - t[:, 0], t[:, 2] - t[:, 0]), axis=1)
    order = np.argsort(part.faces.ravel(), kind="stable")
    vertex = part.faces.ravel()[order]
    starts = np.searchsorted(vertex, np.arange(len(part.vertices) + 1))
    count = np.diff(starts)
    result = np.repeat(normals[:, None], 3, axis=1).reshape(-1, 3)
    total = np.zeros_like(result)
    corner_vertex = part.faces.ravel()
    for step in range(int(count.max())):
        has = step < count[corner_vertex]
        other = order[(starts[corner_vertex] + step).clip(max=len(order) - 1)] // 3
        close = has & (np.einsum("ij,ij->i", normals[other], result) > np.cos(SMOOTH_BELOW))
        total += np.where(close[:, None], normals[other] * areas[other, None], 0.0)
    length = np.linalg.norm(total, axis=1, keepdims=True)
    smooth: FloatArray = np.where(length > 0, total / np.where(length > 0, length, 1), result)
    return smooth.reshape(-1, 3, 3)


def _flat_normals(vertices: FloatArray, faces: IntArray) -> FloatArray:
    a, b, c = np.moveaxis(vertices[faces], 1, 0)
    normals = np.cross(b - a, c - a)
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    return np.repeat(normals[:, None], 3, axis=1)


def _camera(azimuth: float, elevation: float) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Right, up and ahead of the view, world."""
    ahead = -np.array(
        [
            np.cos(elevation) * np.cos(azimuth),
            np.cos(elevation) * np.sin(azimuth),
            np.sin(elevation),
        ]
    )
    right = np.array([-np.sin(azimuth), np.cos(azimuth), 0.0])
    return right, np.cross(right, ahead), ahead


def _pixels(
    framed: FloatArray,
    right: FloatArray,
    up: FloatArray,
    ahead: FloatArray,
    width: int,
    height: int,
) -> FloatArray:
    """Where each pixel's ray begins, shape (H * W, 3), world."""
    x, y = framed @ right, framed @ up
    middle = 0.5 * (x.min() + x.max()), 0.5 * (y.min() + y.max())
    scale = 1.12 * max(np.ptp(x) / width, np.ptp(y) / height)
    columns = middle[0] + scale * (np.arange(width) + 0.5 - width / 2)
    rows = middle[1] - scale * (np.arange(height) + 0.5 - height / 2)
    behind = (framed @ ahead).min() - 1.0
    grid = columns[None, :, None] * right + rows[:, None, None] * up + behind * ahead
    result: FloatArray = grid.reshape(-1, 3)
    return result


def _layer(
    solid: Solid, origins: FloatArray, ahead: FloatArray, up: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Color (N, 3) and depth (N,) of one solid; infinite depth where it is not."""
    scene = RaycastScene(solid.vertices, solid.faces)
    depth, face = scene.cast(origins, np.broadcast_to(ahead, origins.shape))
    hit = np.isfinite(depth)
    color = np.zeros_like(origins)
    points = origins[hit] + depth[hit, None] * ahead
    normals = _interpolated(solid, points, face[hit])
    base = (
        solid.color(points, normals)
        if callable(solid.color)
        else np.broadcast_to(solid.color, points.shape)
    )
    light = _light(normals, ahead, up)[:, None]
    # Colors that carry meaning keep most of their brightness in the shade.
    color[hit] = base * (0.55 + 0.45 * light if callable(solid.color) else light)
    return color, depth


def _interpolated(solid: Solid, points: FloatArray, face: IntArray) -> FloatArray:
    """Normals at points on faces, from the faces' corners."""
    a, b, c = np.moveaxis(solid.vertices[solid.faces[face]], 1, 0)
    cross = np.cross(b - a, c - a)
    area = np.einsum("ij,ij->i", cross, cross)
    u = np.einsum("ij,ij->i", np.cross(c - b, points - b), cross) / area
    v = np.einsum("ij,ij->i", np.cross(a - c, points - c), cross) / area
    weights = np.stack([u, v, 1 - u - v], axis=1).clip(0, 1)
    normals = np.einsum("ni,nij->nj", weights, solid.normals[face])
    result: FloatArray = normals / np.linalg.norm(normals, axis=1, keepdims=True).clip(1e-12)
    return result


def _light(normals: FloatArray, ahead: FloatArray, up: FloatArray) -> FloatArray:
    """Brightness: a key light from above the camera, a fill light from the left, some ambient."""
    right = np.cross(ahead, up)
    key = -0.62 * ahead + 0.70 * up + 0.35 * right
    fill = -0.50 * ahead - 0.85 * right + 0.15 * up
    lit = 0.40 + 0.58 * (normals @ (key / np.linalg.norm(key))).clip(0)
    lit += 0.18 * (normals @ (fill / np.linalg.norm(fill))).clip(0)
    brightness: FloatArray = lit
    return brightness


def _blend(picture: FloatArray, seen: FloatArray, color: FloatArray, opacity: float) -> None:
    """Put a layer's color over what is already in the picture."""
    under = picture[seen]
    alpha = opacity + under[:, 3:] * (1 - opacity)
    mixed = color[seen] * opacity + under[:, :3] * under[:, 3:] * (1 - opacity)
    picture[seen] = np.concatenate([mixed / alpha, alpha], axis=1)
