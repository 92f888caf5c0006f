"""A perfect view of the simulated cell: depth, angle of incidence, shadows and color."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from reach.arrays import BoolArray, FloatArray
from reach.objects import GraspObject
from reach.raycast import RaycastScene
from reach.transforms import apply, inverse
from registration.frame import Intrinsics

SELF_SHADOW = 2e-5
"""A shadow ray starts this far off the surface [m]."""
MARGIN = 3
"""Pixels around the object's outline that are cast as well."""
_TABLE_COLOR = np.array([150.0, 128.0, 110.0])
_OBJECT_COLOR = np.array([238.0, 115.0, 46.0])


@dataclass(frozen=True, slots=True, eq=False)
class PerfectView:
    """What an ideal camera sees, all (H, W).

    Args:
        depth: along the optical axis, NaN where nothing is hit [m].
        incidence: cosine between surface normal and ray.
        shadow: where the second eye does not see the point.
        color: RGB, shape (H, W, 3), uint8.
    """

    depth: FloatArray
    incidence: FloatArray
    shadow: BoolArray
    color: NDArray[np.uint8]


class CellView:
    """Renders one object on the table by ray casting.

    The table is a plane and needs no casting; rays are cast only where the object's outline is.

    Args:
        intrinsics: of the camera.
        T_world_camera: true pose of the camera, shape (4, 4).
        second_eye: position of the projector or second camera, world frame (3,) [m].
        table_height: world z of the table [m].
    """

    def __init__(
        self,
        intrinsics: Intrinsics,
        T_world_camera: FloatArray,
        second_eye: FloatArray,
        table_height: float,
    ) -> None:
        self._intrinsics = intrinsics
        self._T_world_camera = T_world_camera
        self._eye = T_world_camera[:3, 3]
        self._second_eye = second_eye
        self._table_height = table_height
        rays = intrinsics.rays() @ T_world_camera[:3, :3].T
        self._lengths = np.linalg.norm(rays, axis=-1)
        self._directions = rays / self._lengths[..., None]
        self._object: GraspObject | None = None
        self._scene: RaycastScene | None = None

    def render(self, obj: GraspObject | None, T_world_object: FloatArray | None) -> PerfectView:
        """Render the table and, if there is one, the object."""
        distance, normals = self._table()
        is_object = np.zeros(distance.shape, dtype=bool)
        if obj is not None and T_world_object is not None:
            self._use(obj)
            self._add_object(obj, T_world_object, distance, normals, is_object)
        facing = -np.einsum("hwi,hwi->hw", normals, self._directions)
        shadow = self._shadow(distance, T_world_object)
        return PerfectView(
            depth=np.where(np.isfinite(distance), distance / self._lengths, np.nan),
            incidence=np.where(np.isfinite(distance), facing, 0.0),
            shadow=shadow,
            color=self._color(normals, is_object, shadow, np.isfinite(distance)),
        )

    def _use(self, obj: GraspObject) -> None:
        if self._object is not obj:
            self._object, self._scene = obj, RaycastScene(obj.vertices, obj.faces)

    def _table(self) -> tuple[FloatArray, FloatArray]:
        """Distance along each ray to the table (inf if never), and normals."""
        down = self._directions[..., 2]
        with np.errstate(divide="ignore"):
            distance = (self._table_height - self._eye[2]) / down
        distance = np.where(down < -1e-6, distance, np.inf)
        return distance, np.broadcast_to([0.0, 0.0, 1.0], self._directions.shape).copy()

    def _add_object(
        self,
        obj: GraspObject,
        T_world_object: FloatArray,
        distance: FloatArray,
        normals: FloatArray,
        is_object: BoolArray,
    ) -> None:
        window = self._outline(apply(T_world_object, obj.vertices))
        if window is None:
            return
        assert self._scene is not None
        T_object_world = inverse(T_world_object)
        directions = self._directions[window]
        shape = directions.shape[:2]
        hits, faces = self._scene.cast(
            np.broadcast_to(apply(T_object_world, self._eye[None]), (shape[0] * shape[1], 3)),
            directions.reshape(-1, 3) @ T_object_world[:3, :3].T,
        )
        nearer = hits.reshape(shape) < distance[window]
        distance[window] = np.where(nearer, hits.reshape(shape), distance[window])
        turned = obj.face_normals[np.maximum(faces, 0)] @ T_world_object[:3, :3].T
        normals[window] = np.where(nearer[..., None], turned.reshape(*shape, 3), normals[window])
        is_object[window] = nearer

    def _outline(self, points_world: FloatArray) -> tuple[slice, slice] | None:
        """Rows and columns that can see any of some points; None if no pixel can."""
        points = apply(inverse(self._T_world_camera), points_world)
        camera = self._intrinsics
        z = np.maximum(points[:, 2], 1e-3)
        u = points[:, 0] / z * camera.fx + camera.cx
        v = points[:, 1] / z * camera.fy + camera.cy
        columns = _span(u, camera.width)
        rows = _span(v, camera.height)
        return None if columns is None or rows is None else (rows, columns)

    def _shadow(self, distance: FloatArray, T_world_object: FloatArray | None) -> BoolArray:
        """Where the object stands between a seen point and the second eye."""
        shadow = np.zeros(distance.shape, dtype=bool)
        if T_world_object is None or self._scene is None or self._object is None:
            return shadow
        seen = np.isfinite(distance) & self._near_object(distance, T_world_object)
        points = self._eye + self._directions[seen] * distance[seen][:, None]
        toward = self._second_eye - points
        length = np.linalg.norm(toward, axis=1)
        toward /= length[:, None]
        T_object_world = inverse(T_world_object)
        origins = apply(T_object_world, points + SELF_SHADOW * toward)
        hits, _ = self._scene.cast(origins, toward @ T_object_world[:3, :3].T)
        shadow[seen] = hits < length
        return shadow

    def _near_object(self, distance: FloatArray, T_world_object: FloatArray) -> BoolArray:
        """Points that the object's shadow can reach: the rest needs no ray."""
        obj = self._object
        assert obj is not None
        corners = apply(T_world_object, obj.vertices)
        # Shadow of each vertex on the table, cast from the second eye.
        fall = (self._second_eye[2] - self._table_height) / np.maximum(
            self._second_eye[2] - corners[:, 2], 1e-3
        )
        shadows = self._second_eye + (corners - self._second_eye) * fall[:, None]
        low = np.minimum(corners.min(axis=0), shadows.min(axis=0))[:2] - 1e-3
        high = np.maximum(corners.max(axis=0), shadows.max(axis=0))[:2] + 1e-3
        reach = np.where(np.isfinite(distance), distance, 0.0)[..., None]
        xy = self._eye[:2] + self._directions[..., :2] * reach
        within: BoolArray = np.all((xy >= low) & (xy <= high), axis=-1)
        return within

    def _color(
        self, normals: FloatArray, is_object: BoolArray, shadow: BoolArray, hit: BoolArray
    ) -> NDArray[np.uint8]:
        light = np.array([0.3, 0.2, 0.93])
        brightness = 0.45 + 0.55 * np.clip(normals @ light, 0.0, 1.0)
        brightness = np.where(shadow, 0.7 * brightness, brightness) * hit
        base = np.where(is_object[..., None], _OBJECT_COLOR, _TABLE_COLOR)
        color: NDArray[np.uint8] = (base * brightness[..., None]).astype(np.uint8)
        return color


def _span(values: FloatArray, size: int) -> slice | None:
    low = max(0, int(np.floor(values.min())) - MARGIN)
    high = min(size, int(np.ceil(values.max())) + MARGIN + 1)
    return slice(low, high) if low < high else None
