"""Pressure on a patch and its integrals over triangles ([Danielczuk2019] Sect. 4.1)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from reach.arrays import FloatArray
from reach.patch import Patch, triangle_areas


@dataclass(frozen=True, slots=True, eq=False)
class TriangleFrames:
    """Frame of each triangle: origin at the barycenter, z inward normal, x to the first vertex.

    Attributes:
        T_pad_triangle: shape (M, 4, 4).
        x: coordinate of the three vertices, shape (M, 3) [m].
        y: likewise.
        areas: A_i, shape (M,) [m^2].
        coefficients: a, b, d of q = a x + b y + d, n . a included, shape (M, 3).
    """

    T_pad_triangle: FloatArray
    x: FloatArray
    y: FloatArray
    areas: FloatArray
    coefficients: FloatArray


def shape_of_pressure(patch: Patch, points_pad: FloatArray, normals_pad: FloatArray) -> FloatArray:
    """Evaluate q = delta(r) (n . a) at points (..., 3), the pressure p = k q without its k [m]."""
    delta = patch.contact_depth + patch.deformation - points_pad[..., 2]
    q: FloatArray = delta * normals_pad[..., 2]
    return q


def triangle_frames(patch: Patch) -> TriangleFrames:
    """Build the triangles' frames and the linear pressure on each."""
    triangles, normals = patch.triangles_pad, patch.normals_pad
    origin = triangles.mean(axis=1)
    x_axis = triangles[:, 0] - origin
    x_axis = x_axis / np.linalg.norm(x_axis, axis=1, keepdims=True)
    y_axis = np.cross(normals, x_axis)
    T = np.zeros((len(triangles), 4, 4))
    T[:, :3, 0], T[:, :3, 1], T[:, :3, 2] = x_axis, y_axis, normals
    T[:, :3, 3], T[:, 3, 3] = origin, 1.0
    arms = triangles - origin[:, None]
    # q falls with depth z, so its slope along a tangent is minus the tangent's z, times n . a.
    coefficients = np.column_stack(
        [
            -x_axis[:, 2] * normals[:, 2],
            -y_axis[:, 2] * normals[:, 2],
            shape_of_pressure(patch, origin, normals),
        ]
    )
    return TriangleFrames(
        T,
        np.einsum("mij,mj->mi", arms, x_axis),
        np.einsum("mij,mj->mi", arms, y_axis),
        triangle_areas(triangles),
        coefficients,
    )


def normal_integrals(frames: TriangleFrames) -> FloatArray:
    """Integral of q over each triangle, f_z,i,max / k, shape (M,) [m^3]."""
    a, b, d = frames.coefficients.T
    sums: FloatArray = a * frames.x.sum(axis=1) + b * frames.y.sum(axis=1) + 3.0 * d
    return frames.areas / 3.0 * sums


def stiffness(frames: TriangleFrames, force: float) -> float:
    """Constant k of a contact, from f_C = sum of f_z,i,max [N/m^3]."""
    return force / float(normal_integrals(frames).sum())


def moment_integrals(frames: TriangleFrames) -> tuple[FloatArray, FloatArray]:
    """Integrals of x q and y q over each triangle, shapes (M,) [m^4], by barycentric monomials."""
    a, b, d = frames.coefficients.T
    x, y, area = frames.x, frames.y, frames.areas
    sx, sy = x.sum(axis=1), y.sum(axis=1)
    xx = area / 12.0 * ((x * x).sum(axis=1) + sx * sx)
    yy = area / 12.0 * ((y * y).sum(axis=1) + sy * sy)
    xy = area / 12.0 * ((x * y).sum(axis=1) + sx * sy)
    return a * xx + b * xy + d * area / 3.0 * sx, a * xy + b * yy + d * area / 3.0 * sy


def torsion_bounds(frames: TriangleFrames, k: float, friction: float) -> FloatArray:
    """Lower bound of each triangle's torsional limit, shape (M,) [N m].

    tau_z,max >= mu (k / sqrt 2) (|int x q dA| + |int y q dA|); zero under uniform pressure, because
    the frame's origin is the barycenter.
    """
    moment_x, moment_y = moment_integrals(frames)
    bounds: FloatArray = friction * k / np.sqrt(2.0) * (np.abs(moment_x) + np.abs(moment_y))
    return bounds
