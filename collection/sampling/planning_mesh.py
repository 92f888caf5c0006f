"""A lighter mesh to plan on, where a scan has more triangles than planning needs."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from reach.arrays import FloatArray, IntArray
from reach.objects import GraspObject
from reach.raycast import RaycastScene

MAX_FACES = 20_000
TARGET_FACES = 10_000
MAX_DEVIATION = 3e-4
"""Largest distance between the surfaces; a worse one is not used [m]."""


@dataclass(frozen=True, slots=True, eq=False)
class PlanningMesh:
    """Vertices (V, 3) [m] and faces (F, 3) to plan on, and a note if they are not the part's."""

    vertices: FloatArray
    faces: IntArray
    note: str = ""


def planning_mesh(obj: GraspObject) -> PlanningMesh:
    """The part's mesh, or a decimated one if it has more than MAX_FACES triangles.

    Only planning uses it: contact models score the part's own mesh.
    """
    if len(obj.faces) <= MAX_FACES:
        return PlanningMesh(obj.vertices, obj.faces)
    vertices, faces = _decimated(obj)
    deviation = max(
        RaycastScene(vertices, faces).distance(obj.vertices).max(),
        RaycastScene(obj.vertices, obj.faces).distance(vertices).max(),
    )
    if deviation > MAX_DEVIATION:
        note = (
            f"{obj.name}: planned on all {len(obj.faces)} faces, because a lighter mesh would be "
            f"{deviation * 1e3:.2f} mm off"
        )
        return PlanningMesh(obj.vertices, obj.faces, note)
    note = (
        f"{obj.name}: planned on {len(faces)} of its {len(obj.faces)} faces "
        f"(at most {deviation * 1e3:.2f} mm off), scored on all of them"
    )
    return PlanningMesh(vertices, faces, note)


def _decimated(obj: GraspObject) -> tuple[FloatArray, IntArray]:
    import open3d

    mesh = open3d.geometry.TriangleMesh(
        open3d.utility.Vector3dVector(np.array(obj.vertices)),
        open3d.utility.Vector3iVector(np.array(obj.faces, dtype=np.int32)),
    )
    light = mesh.simplify_quadric_decimation(TARGET_FACES)
    return np.asarray(light.vertices), np.asarray(light.triangles).astype(np.int64)
