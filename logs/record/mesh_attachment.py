"""A mesh as a binary PLY file of doubles: any tool opens it, and no bit of it is lost."""

from __future__ import annotations

import re

import numpy as np

from logs.errors import RecordReadError
from logs.record.records import AttachmentRecord
from reach.arrays import FloatArray, IntArray, frozen
from reach.objects import GraspObject

OBJECT_MESH = "object.ply"
PLY = "model/ply"
_HEADER = """ply
format binary_little_endian 1.0
comment {name}, meters
element vertex {vertices}
property double x
property double y
property double z
element face {faces}
property list uchar int vertex_indices
end_header
"""
_PARSE = re.compile(
    re.escape(_HEADER)
    .replace(re.escape("{name}"), "(?P<name>[^\n]*)")
    .replace(re.escape("{vertices}"), "(?P<vertices>[0-9]+)")
    .replace(re.escape("{faces}"), "(?P<faces>[0-9]+)")
    .encode()
)
_FACE = np.dtype([("count", "u1"), ("corners", "<i4", (3,))])


def mesh_attachment(obj: GraspObject) -> AttachmentRecord:
    """The object's surface, in its own frame."""
    name = obj.name.replace("\n", " ")
    header = _HEADER.format(name=name, vertices=len(obj.vertices), faces=len(obj.faces))
    faces = np.empty(len(obj.faces), _FACE)
    faces["count"] = 3
    faces["corners"] = obj.faces
    data = header.encode() + obj.vertices.astype("<f8").tobytes() + faces.tobytes()
    return AttachmentRecord(OBJECT_MESH, PLY, data)


def read_mesh(data: bytes) -> tuple[FloatArray, IntArray]:
    """Vertices (V, 3) [m] and faces (F, 3) of a mesh that `mesh_attachment` wrote.

    Raises:
        RecordReadError: if the file has another form.
    """
    match = _PARSE.match(data)
    if match is None:
        raise RecordReadError("the record's mesh is not a PLY file of the form this project writes")
    vertex_count, face_count = int(match["vertices"]), int(match["faces"])
    start = match.end()
    middle = start + 24 * vertex_count
    if len(data) != middle + _FACE.itemsize * face_count:
        raise RecordReadError("the record's mesh is shorter or longer than its header says")
    vertices = np.frombuffer(data, "<f8", 3 * vertex_count, start).reshape(-1, 3)
    faces = np.frombuffer(data, _FACE, face_count, middle)
    if np.any(faces["count"] != 3):
        raise RecordReadError("the record's mesh has a face that is no triangle")
    return frozen(vertices), frozen(faces["corners"], np.int64)
