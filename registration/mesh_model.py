"""What registration needs of a mesh, computed once and kept by the mesh's content."""

from __future__ import annotations

from collections import OrderedDict
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import ConvexHull

from reach.arrays import FloatArray
from reach.cache import cache_key, cached_arrays
from reach.objects import GraspObject
from reach.transforms import inverse
from registration.embree import EmbreeMesh
from registration.sdf import (
    MARGIN,
    NODE_LIMITS,
    SPACING,
    SignedDistanceGrid,
    distances,
    sample_signed_distance,
)

SAMPLES = 1600
"""Points sampled on the surface: for distances between poses and for the quick check."""
VERSION = 3
"""Part of the cache's key: raise it when the computation changes."""
KEPT = 24
"""Meshes kept in memory; the least recently used one leaves first."""


@dataclass(frozen=True, slots=True, eq=False)
class MeshModel:
    """A mesh prepared for registration.

    Args:
        obj: the object.
        sdf: signed distances around the surface.
        samples: points spread evenly over the surface, shape (SAMPLES, 3), object frame [m].
        normals: their outward unit normals, shape (SAMPLES, 3).
        hull_vertices: corners of the convex hull, shape (H, 3), object frame [m].
        raycasting: rays and exact distances, object frame.
    """

    obj: GraspObject
    sdf: SignedDistanceGrid
    samples: FloatArray
    normals: FloatArray
    hull_vertices: FloatArray
    raycasting: EmbreeMesh

    def surface_distance(self, T_a: FloatArray, T_b: FloatArray) -> float:
        """Largest two-way distance between the surfaces of two poses of the object [m].

        Poses that a symmetry of the shape maps to each other have distance about zero.

        Args:
            T_a: pose of the object in any frame, shape (4, 4).
            T_b: pose of the object in the same frame, shape (4, 4).
        """
        return float(self.surface_distances(T_a, T_b[None])[0])

    def surface_distances(
        self, T_a: FloatArray, T_b: FloatArray, points: int = SAMPLES
    ) -> FloatArray:
        """Largest two-way distances [m] between one pose (4, 4) and many (N, 4, 4), shape (N,).

        Args:
            T_a: pose of the object in any frame, shape (4, 4).
            T_b: poses of the object in the same frame, shape (N, 4, 4).
            points: how many surface points are compared.
        """
        samples = np.ascontiguousarray(self.samples[:: max(1, SAMPLES // points)])
        there = np.ascontiguousarray(inverse(T_a) @ T_b)
        back = np.ascontiguousarray(inverse(T_b) @ T_a)
        apart: FloatArray = np.maximum(
            np.abs(self.distances(samples, there)).max(axis=1),
            np.abs(self.distances(samples, back)).max(axis=1),
        )
        return apart

    def distances(self, points: FloatArray, T_object_points: FloatArray) -> FloatArray:
        """Signed distances (N, M) [m] of points (M, 3) mapped by transforms (N, 4, 4)."""
        result: FloatArray = distances(
            self.sdf.values, self.sdf.origin, 1.0 / self.sdf.spacing, points, T_object_points
        )
        return result


_models: OrderedDict[str, MeshModel] = OrderedDict()


def mesh_model(obj: GraspObject) -> MeshModel:
    """Prepare a mesh, or return what was prepared before for the same content."""
    key = obj.content_hash
    model = _models.get(key)
    if model is None:
        model = _models[key] = _prepare(obj)
        while len(_models) > KEPT:
            _models.popitem(last=False)
    _models.move_to_end(key)
    return model


def _prepare(obj: GraspObject) -> MeshModel:
    raycasting = EmbreeMesh(obj)
    key = cache_key(
        "registration", VERSION, obj.content_hash, MARGIN, SPACING, NODE_LIMITS, SAMPLES
    )
    arrays = cached_arrays("registration", key, lambda: _compute(obj, raycasting))
    sdf = SignedDistanceGrid(arrays["values"], arrays["origin"], float(arrays["spacing"]))
    return MeshModel(obj, sdf, arrays["samples"], arrays["normals"], arrays["hull"], raycasting)


def _compute(obj: GraspObject, raycasting: EmbreeMesh) -> dict[str, NDArray[Any]]:
    sdf = sample_signed_distance(raycasting, obj.vertices)
    samples, normals = _even_samples(obj)
    return {
        "values": sdf.values,
        "origin": sdf.origin,
        "spacing": np.asarray(sdf.spacing),
        "samples": samples,
        "normals": normals,
        "hull": obj.vertices[ConvexHull(obj.vertices).vertices],
    }


def _even_samples(obj: GraspObject) -> tuple[FloatArray, FloatArray]:
    """Surface samples (SAMPLES, 3) spaced evenly in area along the faces, and their normals."""
    triangles = obj.triangles
    cross = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    cumulative = np.cumsum(np.linalg.norm(cross, axis=1))
    at = (np.arange(SAMPLES) + 0.5) / SAMPLES * cumulative[-1]
    face = np.searchsorted(cumulative, at)
    # The plastic-number sequence fills each triangle evenly whatever face it falls on.
    i = np.arange(SAMPLES)
    a, b = (0.5 + i * 0.7548776662466927) % 1, (0.5 + i * 0.5698402909980532) % 1
    over = a + b > 1
    a, b = np.where(over, 1 - a, a), np.where(over, 1 - b, b)
    t = triangles[face]
    points = t[:, 0] + a[:, None] * (t[:, 1] - t[:, 0]) + b[:, None] * (t[:, 2] - t[:, 0])
    return points, np.ascontiguousarray(obj.face_normals[face])
