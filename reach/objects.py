"""A rigid object to be grasped: a closed triangle mesh with mass properties."""

from __future__ import annotations

import hashlib
import logging
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from reach.arrays import FloatArray, IntArray, frozen, frozen_finite, positive
from reach.errors import InvalidMeshError, UnknownNameError

if TYPE_CHECKING:
    import trimesh

LOGGER = logging.getLogger(__name__)

MESH_UNITS = {"m": 1.0, "cm": 1e-2, "mm": 1e-3, "in": 0.0254}
PLA_DENSITY = 1240.0
"""Density of printed PLA [kg/m^3]."""
SMALLEST_EXTENT, LARGEST_EXTENT = 2e-3, 1.0
"""A part smaller than 2 mm or larger than 1 m is taken for a unit mistake [m]."""


@dataclass(frozen=True, slots=False, eq=False)
class GraspObject:
    """A closed rigid mesh with mass, in its own frame.

    Args:
        name: how plans and tables call it.
        vertices: shape (V, 3), object frame [m].
        faces: shape (F, 3), counter-clockwise seen from outside.
        mass: [kg].
        center_of_mass: shape (3,), object frame [m]; the volume's centroid if None. Read it as
            `com`, which is never None.

    Raises:
        InvalidMeshError: open, inverted, degenerate, or of an absurd size.
        InvalidInputError: mass or center of mass not finite, mass not positive.
    """

    name: str
    vertices: FloatArray
    faces: IntArray
    mass: float
    center_of_mass: FloatArray | None = None

    def __post_init__(self) -> None:
        set_field = object.__setattr__
        try:
            vertices = frozen_finite(self.vertices, f"vertices of {self.name!r}", (-1, 3))
        except ValueError as error:
            raise InvalidMeshError(str(error)) from error
        faces = frozen(self.faces, np.int64)
        _check_closed(self.name, vertices, faces)
        set_field(self, "vertices", vertices)
        set_field(self, "faces", faces)
        set_field(self, "mass", positive(self.mass, f"mass of {self.name!r} [kg]"))
        if self.center_of_mass is not None:
            set_field(
                self, "center_of_mass", frozen_finite(self.center_of_mass, "center_of_mass", (3,))
            )

    @classmethod
    def load(
        cls,
        path: str | Path,
        *,
        mass: float | None = None,
        density: float = PLA_DENSITY,
        infill: float = 1.0,
        unit: str = "m",
        name: str | None = None,
        repair: bool = False,
    ) -> GraspObject:
        """Read a mesh file (.stl, .obj, .ply, .off, .glb, ...).

        What a file format tears apart is joined again (equal vertices are merged, repeated faces
        and faces without area dropped); what says something else than a closed surface with
        outward faces is refused, or mended and told in the log if that is asked for.

        Args:
            path: the mesh file.
            mass: [kg]; if None, volume times density times infill.
            density: of the solid material [kg/m^3].
            infill: printed share of the volume, in (0, 1].
            unit: unit of the file's numbers: m, cm, mm or in.
            name: default is the file's stem.
            repair: close holes of three or four corners and turn inverted faces, with one warning
                in the log for each; a surface that stays open is refused all the same.

        Raises:
            InvalidMeshError: unreadable, open, inverted, degenerate or absurdly sized mesh.
            UnknownNameError: unknown unit.
        """
        path = Path(path)
        mesh = _read_mesh(path)
        if repair:
            _mend(mesh, path)
        if unit not in MESH_UNITS:
            raise UnknownNameError("mesh unit", unit, MESH_UNITS)
        name = name or path.stem
        vertices = np.asarray(mesh.vertices, dtype=float) * MESH_UNITS[unit]
        check_size(name, vertices, unit)
        faces = np.asarray(mesh.faces, dtype=np.int64)
        volume, _ = volume_and_centroid(vertices, faces)
        if mass is None:
            mass = abs(volume) * density * infill
        return cls(name, vertices, faces, mass)

    @cached_property
    def mesh(self) -> trimesh.Trimesh:
        """The surface as a trimesh, object frame [m]; do not modify it."""
        import trimesh

        return trimesh.Trimesh(self.vertices, self.faces, process=False)

    @cached_property
    def content_hash(self) -> str:
        """SHA-256 of the geometry: key of every per-mesh cache, and of records."""
        digest = hashlib.sha256()
        digest.update(np.ascontiguousarray(self.vertices, dtype="<f8").tobytes())
        digest.update(np.ascontiguousarray(self.faces, dtype="<i8").tobytes())
        return digest.hexdigest()

    @cached_property
    def com(self) -> FloatArray:
        """Center of mass, shape (3,), object frame [m]."""
        if self.center_of_mass is not None:
            return self.center_of_mass
        return frozen(volume_and_centroid(self.vertices, self.faces)[1])

    @cached_property
    def volume(self) -> float:
        """Enclosed volume [m^3]."""
        return volume_and_centroid(self.vertices, self.faces)[0]

    @cached_property
    def diameter(self) -> float:
        """Diagonal of the bounding box [m]."""
        return float(np.linalg.norm(np.ptp(self.vertices, axis=0)))

    @cached_property
    def triangles(self) -> FloatArray:
        """Corner points, shape (F, 3, 3), object frame [m]."""
        return frozen(self.vertices[self.faces])

    @cached_property
    def face_normals(self) -> FloatArray:
        """Outward unit normals, shape (F, 3), object frame; zero for a degenerate triangle."""
        t = self.triangles
        cross = np.cross(t[:, 1] - t[:, 0], t[:, 2] - t[:, 0])
        length = np.linalg.norm(cross, axis=1, keepdims=True)
        return frozen(np.divide(cross, length, out=np.zeros_like(cross), where=length > 0))


def volume_and_centroid(vertices: FloatArray, faces: IntArray) -> tuple[float, FloatArray]:
    """Signed volume [m^3] and centroid (3,) [m] of a closed triangle mesh."""
    origin = vertices.mean(axis=0)  # near the part, so that far-off meshes lose no digits
    a, b, c = np.moveaxis(vertices[faces] - origin, 1, 0)
    volumes = np.einsum("ij,ij->i", a, np.cross(b, c)) / 6.0
    volume = float(volumes.sum())
    if volume == 0:
        return 0.0, origin
    return volume, origin + (volumes[:, None] * (a + b + c)).sum(axis=0) / (4.0 * volume)


def check_size(name: str, vertices: ArrayLike, unit: str = "m") -> None:
    """Refuse a part whose extents say that the unit is wrong.

    Raises:
        InvalidMeshError: largest extent below 2 mm or above 1 m.
    """
    extents = np.ptp(np.asarray(vertices, dtype=float), axis=0)
    largest = float(extents.max())
    if SMALLEST_EXTENT <= largest <= LARGEST_EXTENT:
        return
    in_millimeters = largest / MESH_UNITS[unit] * MESH_UNITS["mm"]
    hint = (
        "the file is probably in millimeters: try --mesh-unit mm"
        if unit != "mm" and SMALLEST_EXTENT <= in_millimeters <= LARGEST_EXTENT
        else f"choose --mesh-unit from {', '.join(MESH_UNITS)}"
    )
    raise InvalidMeshError(f"mesh {name!r} read in {unit} is {largest:.4g} m long; {hint}")


def _read_mesh(path: Path) -> Any:
    import trimesh

    if not path.is_file():
        raise InvalidMeshError(f"no mesh file at {str(path)!r}")
    try:
        mesh = trimesh.load_mesh(path, process=True)
    except Exception as error:  # any parser error of any format is the user's unreadable file
        raise InvalidMeshError(f"cannot read mesh {str(path)!r}: {error}") from error
    if not isinstance(mesh, trimesh.Trimesh) or len(mesh.faces) == 0:
        raise InvalidMeshError(f"mesh file {str(path)!r} holds no triangles")
    mesh.merge_vertices(merge_tex=True, merge_norm=True)
    mesh.update_faces(mesh.nondegenerate_faces() & mesh.unique_faces())
    mesh.remove_unreferenced_vertices()
    if len(mesh.faces) == 0:
        raise InvalidMeshError(f"mesh file {str(path)!r} holds only triangles without area")
    return mesh


def _mend(mesh: trimesh.Trimesh, path: Path) -> None:
    """Close small holes and turn inverted faces, and say what was done."""
    import trimesh

    before = len(mesh.faces)
    if not mesh.is_watertight:
        trimesh.repair.fill_holes(mesh)
    if added := len(mesh.faces) - before:
        LOGGER.warning("mesh %s has holes: closed them with %d triangles", path, added)
    read = np.array(mesh.faces)
    trimesh.repair.fix_normals(mesh, multibody=True)
    if turned := int(np.any(read != mesh.faces, axis=1).sum()):
        LOGGER.warning("mesh %s has inverted faces: turned %d of %d", path, turned, len(read))


def _check_closed(name: str, vertices: FloatArray, faces: IntArray) -> None:
    if faces.ndim != 2 or faces.shape[1] != 3 or len(faces) < 4:
        raise InvalidMeshError(
            f"mesh {name!r} has faces of shape {faces.shape}, expected (F>=4, 3)"
        )
    if faces.min() < 0 or faces.max() >= len(vertices):
        raise InvalidMeshError(f"mesh {name!r} has a face that names a missing vertex")
    edges = faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2)
    directed = edges[:, 0] * len(vertices) + edges[:, 1]
    opposite = edges[:, 1] * len(vertices) + edges[:, 0]
    unmatched = len(directed) - int(np.isin(directed, opposite).sum())
    if unmatched:
        raise InvalidMeshError(
            f"mesh {name!r} is not watertight: {unmatched} of its {len(edges)} edges have no partner"
        )
    if len(np.unique(directed)) != len(directed):
        raise InvalidMeshError(f"mesh {name!r} has faces of inconsistent winding")
    volume, _ = volume_and_centroid(vertices, faces)
    if volume <= 0:
        raise InvalidMeshError(
            f"mesh {name!r} encloses {volume:.3g} m^3: flat, or turned inside out (normals point inward)"
        )
