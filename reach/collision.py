"""Whether an open gripper hits the part or the table, by exact tests of boxes and triangles.

A box and a triangle are apart if one of thirteen axes separates them ([AkenineMoller2001]).
Triangles far from a box are skipped by their bounding spheres.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numba
import numpy as np

from reach.arrays import BoolArray, FloatArray, IntArray
from reach.gripper import Box, ParallelJawGripper
from reach.raycast import RaycastScene
from reach.transforms import inverse, make_transform

if TYPE_CHECKING:
    from reach.objects import GraspObject

_ALIGNED = 1e-9


class CollisionChecker:
    """An open gripper against one part and the table.

    Args:
        vertices: of the part, shape (V, 3), object frame [m].
        faces: shape (F, 3).
        gripper: its palm and fingers are tested with the jaws fully open.
        approach: length of the straight way to the grasp along gripper z; the volume that palm
            and fingers sweep on it is tested as well [m].
    """

    def __init__(
        self,
        vertices: FloatArray,
        faces: IntArray,
        gripper: ParallelJawGripper,
        approach: float = 0.0,
    ) -> None:
        self._boxes = gripper.boxes()
        self._swept = [part for box in self._boxes for part in _swept(box, approach)]
        self._triangles = np.ascontiguousarray(vertices[faces])
        self._centers = self._triangles.mean(axis=1)
        self._radii = np.linalg.norm(self._triangles - self._centers[:, None], axis=2).max(axis=1)
        self._scene = RaycastScene(vertices, faces)

    @classmethod
    def of(
        cls, obj: GraspObject, gripper: ParallelJawGripper, approach: float = 0.0
    ) -> CollisionChecker:
        """Checker for a part's own mesh."""
        return cls(obj.vertices, obj.faces, gripper, approach)

    def hits_object(self, T_object_gripper: FloatArray) -> BoolArray:
        """Whether palm or fingers touch the part, for poses (N, 4, 4), shape (N,)."""
        hits = np.zeros(len(T_object_gripper), dtype=bool)
        for box in self._swept:
            T_object_box = T_object_gripper @ box.T_gripper_box
            # A box that no triangle cuts may still lie wholly within the solid.
            hits |= self._scene.inside(T_object_box[:, :3, 3])
            _mark_hits(
                inverse(T_object_box),
                box.half_extents,
                self._triangles,
                self._centers,
                self._radii,
                hits,
            )
        return hits

    def lowest_point(self, T_world_gripper: FloatArray) -> FloatArray:
        """World z of the gripper's lowest corner, for poses (N, 4, 4), shape (N,) [m]."""
        lows = []
        for box in self._boxes:
            T_world_box = T_world_gripper @ box.T_gripper_box
            reach_down = np.abs(T_world_box[:, 2, :3]) @ box.half_extents
            lows.append(T_world_box[:, 2, 3] - reach_down)
        lowest: FloatArray = np.min(lows, axis=0)
        return lowest


def _swept(box: Box, length: float) -> list[Box]:
    """Boxes that together cover a box's way of a length [m] along gripper z to where it is."""
    if length == 0.0:
        return [box]
    along = np.abs(box.T_gripper_box[2, :3])
    axis = int(along.argmax())
    if along[axis] > 1.0 - _ALIGNED:  # along one of its own axes a box sweeps a longer box
        half = box.half_extents.copy()
        half[axis] += length / 2
        return [Box(_moved_back(box, length / 2), half)]
    steps = int(np.ceil(length / float(box.half_extents.min())))
    return [
        Box(_moved_back(box, back), box.half_extents) for back in np.linspace(0, length, steps + 1)
    ]


def _moved_back(box: Box, distance: float) -> FloatArray:
    return make_transform(None, (0, 0, -distance)) @ box.T_gripper_box


@numba.njit(cache=True, nogil=True)
def _mark_hits(
    T_box_object: FloatArray,
    half: FloatArray,
    triangles: FloatArray,
    centers: FloatArray,
    radii: FloatArray,
    hits: BoolArray,
) -> None:
    """Set hits[n] where any triangle touches the box in pose n; set ones stay set."""
    corners = np.empty((3, 3))
    for n in range(len(T_box_object)):
        if hits[n]:
            continue
        T = T_box_object[n]
        for f in range(len(triangles)):
            outside = 0.0
            for i in range(3):
                x = T[i, 3]
                for j in range(3):
                    x += T[i, j] * centers[f, j]
                gap = abs(x) - half[i]
                if gap > 0:
                    outside += gap * gap
            if outside > radii[f] * radii[f]:
                continue
            for k in range(3):
                for i in range(3):
                    x = T[i, 3]
                    for j in range(3):
                        x += T[i, j] * triangles[f, k, j]
                    corners[k, i] = x
            if box_touches_triangle(half, corners):
                hits[n] = True
                break


@numba.njit(cache=True, nogil=True)
def box_touches_triangle(half: FloatArray, corners: FloatArray) -> bool:
    """Whether a box centered at the origin and a triangle have a point in common.

    Args:
        half: half extents of the box, shape (3,) [m].
        corners: of the triangle in the box's frame, shape (3, 3) [m].
    """
    for i in range(3):  # the box's face normals
        low = min(corners[0, i], corners[1, i], corners[2, i])
        high = max(corners[0, i], corners[1, i], corners[2, i])
        if low > half[i] or high < -half[i]:
            return False
    edges = np.empty((3, 3))
    for k in range(3):
        for i in range(3):
            edges[k, i] = corners[(k + 1) % 3, i] - corners[k, i]
    axis = np.empty(3)
    for i in range(3):  # the triangle's normal
        j, k = (i + 1) % 3, (i + 2) % 3
        axis[i] = edges[0, j] * edges[1, k] - edges[0, k] * edges[1, j]
    if _separates(axis, half, corners):
        return False
    for e in range(3):  # each edge crossed with each of the box's axes
        for i in range(3):
            j, k = (i + 1) % 3, (i + 2) % 3
            axis[i] = 0.0
            axis[j] = -edges[e, k]
            axis[k] = edges[e, j]
            if _separates(axis, half, corners):
                return False
    return True


@numba.njit(cache=True, nogil=True)
def _separates(axis: FloatArray, half: FloatArray, corners: FloatArray) -> bool:
    radius = abs(axis[0]) * half[0] + abs(axis[1]) * half[1] + abs(axis[2]) * half[2]
    low = np.inf
    high = -np.inf
    for k in range(3):
        p = axis[0] * corners[k, 0] + axis[1] * corners[k, 1] + axis[2] * corners[k, 2]
        low = min(low, p)
        high = max(high, p)
    return bool(low > radius or high < -radius)
