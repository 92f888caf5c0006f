"""Open3D's Embree scene of one mesh, with plain arrays and on one thread."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from reach.arrays import FloatArray
from reach.objects import GraspObject

Float32Array = NDArray[np.float32]


class EmbreeMesh:
    """A closed mesh to cast rays at and to measure distances from, object frame [m].

    Queries run on one thread: a station has better uses for the others, and batches are small.
    """

    def __init__(self, obj: GraspObject) -> None:
        import open3d

        core: Any = open3d.core
        self._tensor = core.Tensor
        self._scene: Any = open3d.t.geometry.RaycastingScene(nthreads=1)
        self._scene.add_triangles(
            self._tensor(obj.vertices.astype(np.float32)),
            self._tensor(obj.faces.astype(np.uint32)),
        )

    def cast(self, rays: Float32Array) -> tuple[Float32Array, Float32Array]:
        """First hits of rays (N, 6), origin and direction.

        Returns:
            Lengths (N,) in units of the directions' lengths, inf for a miss, and unit normals
            (N, 3) of the faces hit.
        """
        answer = self._scene.cast_rays(self._tensor(rays), nthreads=1)
        return answer["t_hit"].numpy(), answer["primitive_normals"].numpy()

    def closest(self, points: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Nearest surface points (N, 3) of points (N, 3) and the unit normals there (N, 3)."""
        answer = self._scene.compute_closest_points(
            self._tensor(points.astype(np.float32)), nthreads=1
        )
        nearest: FloatArray = answer["points"].numpy().astype(float)
        normals: FloatArray = answer["primitive_normals"].numpy().astype(float)
        return nearest, normals

    def signed_distance(self, points: FloatArray) -> Float32Array:
        """Distances (...) from the surface of points (..., 3), negative inside."""
        answer = self._scene.compute_signed_distance(
            self._tensor(points.astype(np.float32)), nthreads=1, nsamples=3
        )
        distance: Float32Array = answer.numpy()
        return distance
