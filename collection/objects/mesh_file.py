"""Read a user's mesh; join solids that overlap, refuse what is no solid in one line."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from reach.errors import InvalidMeshError
from reach.objects import GraspObject

if TYPE_CHECKING:
    import trimesh
    from manifold3d import Manifold

_WELD = 1e-7
"""Vertices closer than this are one [m]."""
_CHECKABLE_FACES = 20_000
_THIN = 1e-3


def read_part(path: Path, unit: str) -> GraspObject:
    """Read a mesh file as one rigid part.

    Solids that overlap are joined into one; an inner wall between them would otherwise count as
    a surface to hold, and their common volume twice.

    Args:
        path: the mesh file.
        unit: of its numbers: m, cm, mm or in.

    Raises:
        InvalidMeshError: unreadable, open, inverted, flat or absurdly sized; or pieces that do
            not touch or enclose a hollow.
        UnknownNameError: unknown unit.
    """
    part = GraspObject.load(path, unit=unit)
    if part.mesh.body_count == 1:
        return part
    return _joined(part)


def mesh_notes(part: GraspObject) -> list[str]:
    """What is odd about a usable mesh, one line each."""
    notes = []
    if len(part.faces) <= _CHECKABLE_FACES and _intersects_itself(part):
        notes.append(
            f"{part.name}: the surface intersects itself; contacts there and the mass are doubtful"
        )
    if float(np.ptp(part.vertices, axis=0).min()) < _THIN:
        notes.append(f"{part.name}: the part is thinner than {_THIN * 1e3:.0f} mm")
    return notes


def _joined(part: GraspObject) -> GraspObject:
    from manifold3d import Manifold, OpType

    solids = [_manifold(part.name, piece) for piece in part.mesh.split(only_watertight=False)]
    union = Manifold.batch_boolean(solids, OpType.Add)
    pieces = union.decompose()
    if len(pieces) != 1:
        raise InvalidMeshError(
            f"mesh {part.name!r} holds {len(pieces)} pieces that do not touch; a part is one piece"
        )
    mesh = union.simplify(_WELD).to_mesh64()
    vertices = np.asarray(mesh.vert_properties[:, :3], dtype=float)
    return GraspObject(part.name, vertices, np.asarray(mesh.tri_verts, np.int64), part.mass)


def _manifold(name: str, piece: trimesh.Trimesh) -> Manifold:
    from manifold3d import Error, Manifold, Mesh64

    mesh = Mesh64(
        np.asarray(piece.vertices, dtype=np.float64),
        np.asarray(piece.faces, dtype=np.uint64),
        tolerance=_WELD,
    )
    mesh.merge()
    solid = Manifold(mesh)
    if solid.status() != Error.NoError or solid.is_empty():
        raise InvalidMeshError(
            f"mesh {name!r} has several pieces and one is no solid ({solid.status().name})"
        )
    if solid.volume() <= 0:
        raise InvalidMeshError(
            f"mesh {name!r} has several pieces and one encloses {solid.volume():.3g} m^3: "
            "turned inside out, or a hollow"
        )
    return solid


def _intersects_itself(part: GraspObject) -> bool:
    import open3d

    surface = open3d.geometry.TriangleMesh(
        open3d.utility.Vector3dVector(np.array(part.vertices)),
        open3d.utility.Vector3iVector(np.array(part.faces, dtype=np.int32)),
    )
    return bool(surface.is_self_intersecting())
