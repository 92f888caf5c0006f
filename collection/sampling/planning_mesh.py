"""A lighter mesh to plan on, where a scan has more triangles than planning needs."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from reach.arrays import FloatArray, IntArray
from reach.cache import cache_key, cached_arrays
from reach.objects import GraspObject
from reach.raycast import RaycastScene

VERSION = 1
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
    key = cache_key("planning mesh", VERSION, TARGET_FACES, obj.content_hash)
    light = cached_arrays("planning_mesh", key, lambda: _decimated(obj))
    deviation_mm = float(light["deviation"]) * 1e3
    if light["deviation"] > MAX_DEVIATION:
        note = (
            f"{obj.name}: planned on all {len(obj.faces)} faces, because a lighter mesh would be "
            f"{deviation_mm:.2f} mm off"
        )
        return PlanningMesh(obj.vertices, obj.faces, note)
    note = (
        f"{obj.name}: planned on {len(light['faces'])} of its {len(obj.faces)} faces "
        f"(at most {deviation_mm:.2f} mm off), scored on all of them"
    )
    return PlanningMesh(light["vertices"], light["faces"], note)


def _decimated(obj: GraspObject) -> dict[str, NDArray[Any]]:
    """A mesh of about TARGET_FACES faces, and the largest distance between the surfaces."""
    import open3d

    mesh = open3d.geometry.TriangleMesh(
        open3d.utility.Vector3dVector(np.array(obj.vertices)),
        open3d.utility.Vector3iVector(np.array(obj.faces, dtype=np.int32)),
    )
    light = mesh.simplify_quadric_decimation(TARGET_FACES)
    vertices = np.asarray(light.vertices)
    faces = np.asarray(light.triangles).astype(np.int64)
    deviation = max(
        RaycastScene(vertices, faces).distance(obj.vertices).max(),
        RaycastScene(obj.vertices, obj.faces).distance(vertices).max(),
    )
    return {"vertices": vertices, "faces": faces, "deviation": np.array(deviation)}
