"""Contact patch of a pad on a part, by solid geometry ([Danielczuk2019] Sect. 4.1).

The readable formulation; `reach.kernels.patch` computes the same by clipping.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from reach.arrays import FloatArray, IntArray, frozen
from reach.errors import InvalidMeshError
from reach.gripper import Pad
from reach.objects import GraspObject
from reach.transforms import inverse

FACING = 1e-6
"""A surface faces the jaw if its inward normal has more than this along the closing direction."""


@dataclass(frozen=True, slots=True, eq=False)
class Patch:
    """Surface of the part that a pad presses on, in the opened pad's frame.

    Attributes:
        triangles_pad: corners, shape (M, 3, 3) [m].
        normals_pad: inward unit normals, shape (M, 3).
        contact_depth: d_con, where the pad first touches [m].
        deformation: d_def, how deep it is pressed in [m].
    """

    triangles_pad: FloatArray
    normals_pad: FloatArray
    contact_depth: float
    deformation: float

    @property
    def areas(self) -> FloatArray:
        """Area of each triangle, shape (M,) [m^2]."""
        return triangle_areas(self.triangles_pad)


def triangle_areas(triangles: FloatArray) -> FloatArray:
    """Areas of triangles (M, 3, 3)."""
    a, b, c = np.moveaxis(triangles, 1, 0)
    areas: FloatArray = 0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1)
    return areas


def pad_prism(pad: Pad, low: float, high: float) -> Any:
    """Solid that a pad's face sweeps between two depths, as a manifold3d.Manifold, pad frame."""
    from manifold3d import CrossSection

    return CrossSection([pad.polygon]).extrude(high - low).translate((0.0, 0.0, low))


def part_in_pad(obj: GraspObject, T_object_pad: FloatArray) -> Any:
    """The part as a manifold3d.Manifold in a pad's frame.

    Raises:
        InvalidMeshError: if the mesh bounds no solid.
    """
    from manifold3d import Error, Manifold, Mesh64

    solid = Manifold(Mesh64(np.array(obj.vertices), obj.faces.astype(np.uint64)))
    if solid.status() != Error.NoError:
        raise InvalidMeshError(f"mesh {obj.name!r} bounds no solid: {solid.status()}")
    return solid.transform(np.ascontiguousarray(inverse(T_object_pad)[:3])).as_original()


def facing_surface(solid: Any, part_id: int) -> tuple[FloatArray, FloatArray]:
    """Triangles of a solid that stem from the part and face the jaw, with inward normals.

    Faces made by cutting are left out: they are no surface of the part.
    """
    mesh = solid.to_mesh64()
    owner = np.zeros(len(mesh.tri_verts), bool)
    for run, original in enumerate(mesh.run_original_id):
        if original == part_id:
            owner[mesh.run_index[run] // 3 : mesh.run_index[run + 1] // 3] = True
    triangles = mesh.vert_properties[:, :3][mesh.tri_verts.astype(np.int64)][owner]
    a, b, c = np.moveaxis(triangles, 1, 0)
    inward = -np.cross(b - a, c - a)
    length = np.linalg.norm(inward, axis=1, keepdims=True)
    inward = np.divide(inward, length, out=np.zeros_like(inward), where=length > 0)
    facing = inward[:, 2] > FACING
    return triangles[facing], inward[facing]


def find_patch(
    obj: GraspObject,
    pad: Pad,
    T_object_pad: FloatArray,
    *,
    low: float,
    high: float,
    deformation: float,
) -> Patch | None:
    """Intersect the pad's prism with the part, and keep the slab that the pad is pressed into.

    Args:
        obj: the part.
        pad: outline and softness.
        T_object_pad: pose of the opened pad, shape (4, 4).
        low: depth at which the search for contact begins [m].
        high: depth at which it ends [m].
        deformation: d_def [m].

    Returns:
        The patch, or None if the pad meets nothing.
    """
    part = part_in_pad(obj, T_object_pad)
    part_id = part.original_id()
    inside = part ^ pad_prism(pad, low, high + deformation)
    triangles, normals = facing_surface(inside, part_id)
    if len(triangles) == 0 or triangles[..., 2].min() >= high:
        return None
    contact_depth = float(triangles[..., 2].min())  # d_con
    slab = inside.trim_by_plane((0.0, 0.0, -1.0), -(contact_depth + deformation))
    triangles, normals = facing_surface(slab, part_id)
    if len(triangles) == 0:
        return None
    return Patch(frozen(triangles), frozen(normals), contact_depth, deformation)


def largest(areas: FloatArray, count: int | None) -> IntArray:
    """Indices of the largest triangles; the paper keeps ten a contact."""
    order = np.argsort(-areas, kind="stable")
    return order if count is None else order[:count]
