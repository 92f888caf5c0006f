"""Rigid transforms as plain read-only (4, 4) arrays.

`T_parent_child` is the pose of child in parent: it maps child coordinates to parent,
`p_world = T_world_object @ p_object`. Inner names cancel:
`T_world_gripper = T_world_camera @ T_camera_object @ T_object_gripper`.

Tangent vectors are ordered (rotation [rad], translation [m]); perturbations act on the right,
`T @ exp(xi)`, so that they are expressed in the child's frame.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from reach.arrays import FloatArray, frozen, frozen_finite
from reach.errors import InvalidInputError, InvalidTransformError

ORTHONORMAL_TOLERANCE = 1e-6


def as_transform(value: ArrayLike, name: str = "transform") -> FloatArray:
    """Validate a rigid transform.

    Args:
        value: shape (4, 4), rotation orthonormal to 1e-6, last row (0, 0, 0, 1).
        name: what it is (`T_world_object`), for the error message.

    Returns:
        A read-only copy, shape (4, 4).

    Raises:
        InvalidTransformError: if it is not a rigid transform.
    """
    try:
        matrix = frozen_finite(value, name, (4, 4))
    except InvalidInputError as error:
        raise InvalidTransformError(str(error)) from error
    rotation = matrix[:3, :3]
    deviation = float(np.abs(rotation.T @ rotation - np.eye(3)).max())
    if deviation > ORTHONORMAL_TOLERANCE:
        raise InvalidTransformError(f"{name} has a rotation {deviation:.2g} off orthonormal")
    if np.linalg.det(rotation) < 0:
        raise InvalidTransformError(f"{name} mirrors: its rotation has determinant -1")
    if not np.array_equal(matrix[3], [0.0, 0.0, 0.0, 1.0]):
        raise InvalidTransformError(f"{name} has the last row {matrix[3]}, expected (0, 0, 0, 1)")
    return matrix


def make_transform(
    rotation: ArrayLike | None = None, translation: ArrayLike = (0, 0, 0)
) -> FloatArray:
    """Build a transform from a (3, 3) rotation (identity if None) and a (3,) translation [m]."""
    matrix = np.eye(4)
    if rotation is not None:
        matrix[:3, :3] = rotation
    matrix[:3, 3] = translation
    return frozen(matrix)


def inverse(T: FloatArray) -> FloatArray:
    """Inverse of one transform (4, 4) or a stack (..., 4, 4)."""
    result = np.zeros_like(T)
    rotation_t = np.swapaxes(T[..., :3, :3], -1, -2)
    result[..., :3, :3] = rotation_t
    result[..., :3, 3] = -(rotation_t @ T[..., :3, 3, None])[..., 0]
    result[..., 3, 3] = 1.0
    return result


def apply(T_parent_child: FloatArray, points_child: FloatArray) -> FloatArray:
    """Map points (N, 3) [m] from child to parent."""
    mapped: FloatArray = points_child @ T_parent_child[:3, :3].T + T_parent_child[:3, 3]
    return mapped


def skew(v: FloatArray) -> FloatArray:
    """Cross-product matrices (..., 3, 3) of vectors (..., 3)."""
    result = np.zeros((*v.shape[:-1], 3, 3))
    result[..., 0, 1], result[..., 0, 2] = -v[..., 2], v[..., 1]
    result[..., 1, 0], result[..., 1, 2] = v[..., 2], -v[..., 0]
    result[..., 2, 0], result[..., 2, 1] = -v[..., 1], v[..., 0]
    return result


def _left_jacobian_coefficients(angle: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return sin(a)/a, (1-cos(a))/a^2 and (a-sin(a))/a^3, by series near zero."""
    small = angle < 1e-5
    a = np.where(small, 1.0, angle)
    s = np.where(small, 1 - angle**2 / 6, np.sin(a) / a)
    c = np.where(small, 0.5 - angle**2 / 24, (1 - np.cos(a)) / a**2)
    d = np.where(small, 1 / 6 - angle**2 / 120, (a - np.sin(a)) / a**3)
    return s, c, d


def exp(xi: ArrayLike) -> FloatArray:
    """Exponential map of tangent vectors (..., 6), (rotation [rad], translation [m])."""
    xi = np.asarray(xi, dtype=float)
    omega, v = xi[..., :3], xi[..., 3:]
    angle = np.linalg.norm(omega, axis=-1)[..., None, None]
    s, c, d = _left_jacobian_coefficients(angle)
    K = skew(omega)
    K2 = K @ K
    result = np.zeros((*xi.shape[:-1], 4, 4))
    result[..., :3, :3] = np.eye(3) + s * K + c * K2
    result[..., :3, 3] = ((np.eye(3) + c * K + d * K2) @ v[..., None])[..., 0]
    result[..., 3, 3] = 1.0
    return result


def log(T: FloatArray) -> FloatArray:
    """Logarithm of one transform (4, 4): the tangent vector (6,), rotation angle up to pi."""
    omega = rotation_log(T[:3, :3])
    angle = np.asarray(np.linalg.norm(omega))
    K = skew(omega)
    s, c, _ = _left_jacobian_coefficients(angle)
    tail = 1 / 12 if angle < 1e-4 else (1 - s / (2 * c)) / angle**2
    v = (np.eye(3) - 0.5 * K + tail * (K @ K)) @ T[:3, 3]
    return np.concatenate([omega, v])


def rotation_log(rotation: FloatArray) -> FloatArray:
    """Rotation vector (3,) [rad] of a rotation matrix (3, 3), angle in [0, pi]."""
    quat_wxyz = quat_wxyz_from_rotation(rotation)
    w, xyz = quat_wxyz[0], quat_wxyz[1:]
    n = float(np.linalg.norm(xyz))
    if n < 1e-12:
        return 2.0 * xyz
    return np.asarray(xyz * (2.0 * np.arctan2(n, w) / n))


def rotation_angle(rotation: FloatArray) -> float:
    """Angle [rad] of a rotation matrix (3, 3)."""
    return float(np.linalg.norm(rotation_log(rotation)))


def rotation_about(axis: ArrayLike, angle: float) -> FloatArray:
    """Rotation matrix (3, 3) about an axis (3,), by an angle [rad]."""
    unit = np.asarray(axis, dtype=float)
    unit = unit / np.linalg.norm(unit)
    rotation: FloatArray = exp(np.concatenate([unit * angle, np.zeros(3)]))[:3, :3]
    return rotation


def quat_wxyz_from_rotation(rotation: FloatArray) -> FloatArray:
    """Unit quaternion (4,), w first and w >= 0, of a rotation matrix (3, 3)."""
    # Bar-Itzhack: the quaternion is the leading eigenvector of a symmetric 4x4 matrix, which is
    # stable at every angle and projects a slightly non-orthonormal matrix.
    r = rotation
    K = np.array(
        [
            [r[0, 0] - r[1, 1] - r[2, 2], 0, 0, 0],
            [r[0, 1] + r[1, 0], r[1, 1] - r[0, 0] - r[2, 2], 0, 0],
            [r[0, 2] + r[2, 0], r[1, 2] + r[2, 1], r[2, 2] - r[0, 0] - r[1, 1], 0],
            [r[2, 1] - r[1, 2], r[0, 2] - r[2, 0], r[1, 0] - r[0, 1], r[0, 0] + r[1, 1] + r[2, 2]],
        ]
    )
    _, vectors = np.linalg.eigh(K / 3.0, UPLO="L")
    x, y, z, w = vectors[:, -1]
    quat_wxyz = np.array([w, x, y, z])
    return quat_wxyz if w >= 0 else -quat_wxyz


def rotation_from_quat_wxyz(quat_wxyz: ArrayLike) -> FloatArray:
    """Rotation matrix (3, 3) of a quaternion (4,), w first; it need not be normalized.

    Raises:
        InvalidTransformError: if the quaternion is zero or not finite.
    """
    q = np.asarray(quat_wxyz, dtype=float)
    n = float(np.linalg.norm(q)) if q.shape == (4,) else 0.0
    if not np.isfinite(n) or n < 1e-12:
        raise InvalidTransformError(f"quaternion (w, x, y, z) {quat_wxyz!r} cannot be normalized")
    w, x, y, z = q / n
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ]
    )


def project_to_rotation(matrix: FloatArray) -> FloatArray:
    """Nearest rotation (3, 3) to a matrix, in the Frobenius norm (orthogonal Procrustes)."""
    u, _, vt = np.linalg.svd(matrix)
    u[:, -1] *= np.sign(np.linalg.det(u @ vt))
    result: FloatArray = u @ vt
    return result


def adjoint(T: FloatArray) -> FloatArray:
    """Adjoint (6, 6): `T @ exp(xi) @ inverse(T) == exp(adjoint(T) @ xi)`."""
    rotation, translation = T[:3, :3], T[:3, 3]
    result = np.zeros((6, 6))
    result[:3, :3] = result[3:, 3:] = rotation
    result[3:, :3] = skew(translation) @ rotation
    return result
