"""From a solid drawn in millimeters to a part in meters."""

from __future__ import annotations

import numpy as np

from collection.objects.printing import printed_mass
from collection.objects.solids import Solid
from reach.objects import MESH_UNITS, GraspObject, volume_and_centroid

SLIVER_MM = 1e-3
"""Details below a micrometer are leftovers of the cuts between solids."""


def draw(name: str, solid: Solid) -> GraspObject:
    """Make a part of a drawn solid; its frame's origin is the center of its volume."""
    mesh = solid.simplify(SLIVER_MM).to_mesh64()
    vertices = np.asarray(mesh.vert_properties[:, :3], dtype=float) * MESH_UNITS["mm"]
    faces = np.asarray(mesh.tri_verts, dtype=np.int64)
    vertices = vertices - volume_and_centroid(vertices, faces)[1]
    return GraspObject(name, vertices, faces, printed_mass(vertices, faces))
