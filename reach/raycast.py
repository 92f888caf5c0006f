"""Rays against, and distances from, a triangle mesh: Open3D's Embree scene with plain arrays."""

from __future__ import annotations

from typing import Any

import numpy as np

from reach.arrays import BoolArray, FloatArray, IntArray

NO_FACE = -1


class RaycastScene:
    """A mesh that rays are cast at, in batches.

    Embree works in single precision: lengths are good to about 1e-7 of the coordinates' size,
    so coordinates are taken relative to the mesh's middle.

    Args:
        vertices: shape (V, 3) [m].
        faces: shape (F, 3).
    """

    def __init__(self, vertices: FloatArray, faces: IntArray) -> None:
        import open3d

        self._core: Any = open3d.core
        self._middle = 0.5 * (vertices.min(axis=0) + vertices.max(axis=0))
        self._scene: Any = open3d.t.geometry.RaycastingScene()
        self._scene.add_triangles(
            self._tensor(vertices - self._middle), self._core.Tensor(faces.astype(np.uint32))
        )

    def cast(self, origins: FloatArray, directions: FloatArray) -> tuple[FloatArray, IntArray]:
        """First hit of each ray.

        Args:
            origins: shape (N, 3) [m].
            directions: unit vectors, shape (N, 3).

        Returns:
            Distances (N,) [m], infinite for a miss, and faces (N,), NO_FACE for a miss.
        """
        rays = np.concatenate([origins - self._middle, directions], axis=1)
        answer = self._scene.cast_rays(self._tensor(rays))
        distance: FloatArray = answer["t_hit"].numpy().astype(float)
        face = answer["primitive_ids"].numpy().astype(np.int64)
        face[~np.isfinite(distance)] = NO_FACE
        return distance, face

    def cast_all(
        self, origins: FloatArray, directions: FloatArray
    ) -> tuple[IntArray, FloatArray, IntArray]:
        """Every crossing of each ray with the surface.

        Args:
            origins: shape (N, 3) [m].
            directions: unit vectors, shape (N, 3).

        Returns:
            Of each crossing the ray's number, the distance [m] and the face, all shape (M,),
            sorted by ray, then by distance.
        """
        rays = np.concatenate([origins - self._middle, directions], axis=1)
        answer = self._scene.list_intersections(self._tensor(rays))
        ray = answer["ray_ids"].numpy().astype(np.int64)
        distance = answer["t_hit"].numpy().astype(float)
        face = answer["primitive_ids"].numpy().astype(np.int64)
        order = np.lexsort((face, distance, ray))
        return ray[order], distance[order], face[order]

    def inside(self, points: FloatArray) -> BoolArray:
        """Whether points (N, 3) lie in the closed surface, shape (N,)."""
        occupancy = self._scene.compute_occupancy(self._tensor(points - self._middle), nsamples=3)
        within: BoolArray = occupancy.numpy() > 0.5
        return within

    def distance(self, points: FloatArray) -> FloatArray:
        """Distance [m] of points (N, 3) from the surface, never negative, shape (N,)."""
        answer = self._scene.compute_distance(self._tensor(points - self._middle))
        distance: FloatArray = answer.numpy().astype(float)
        return distance

    def _tensor(self, values: FloatArray) -> Any:
        return self._core.Tensor(np.ascontiguousarray(values, dtype=np.float32))
