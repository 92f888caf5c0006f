"""The group axioms, the convention T_parent_child, and the exponential map."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from reach import transforms as tf
from reach.errors import InvalidTransformError

tangents = st.lists(st.floats(-1.7, 1.7), min_size=6, max_size=6).map(np.array)


@given(tangents, tangents)
def test_group_axioms(a, b):
    A, B = tf.exp(a), tf.exp(b)
    np.testing.assert_allclose(A @ tf.inverse(A), np.eye(4), atol=1e-12)
    np.testing.assert_allclose(tf.inverse(A @ B), tf.inverse(B) @ tf.inverse(A), atol=1e-12)
    tf.as_transform(A @ B)


@given(tangents)
def test_log_inverts_exp(xi):
    if np.linalg.norm(xi[:3]) < np.pi - 1e-3:
        np.testing.assert_allclose(tf.log(tf.exp(xi)), xi, atol=1e-8)


@given(tangents)
def test_quaternion_round_trip(xi):
    R = tf.exp(xi)[:3, :3]
    np.testing.assert_allclose(
        tf.rotation_from_quat_wxyz(tf.quat_wxyz_from_rotation(R)), R, atol=1e-12
    )


@given(tangents, tangents)
def test_adjoint_moves_a_tangent_between_frames(a, xi):
    T = tf.exp(a)
    small = 1e-2 * xi
    np.testing.assert_allclose(
        T @ tf.exp(small) @ tf.inverse(T), tf.exp(tf.adjoint(T) @ small), atol=1e-9
    )


def test_parent_child_convention():
    # The child sits 1 m ahead of the parent along x and is turned left by 90 degrees: what lies
    # ahead of the child (its +x) lies to the left of the parent (+y).
    T_parent_child = tf.make_transform(tf.rotation_about((0, 0, 1), np.pi / 2), (1, 0, 0))
    np.testing.assert_allclose(tf.apply(T_parent_child, np.array([[2.0, 0, 0]])), [[1, 2, 0]])


def test_log_at_half_a_turn():
    R = tf.rotation_about((1, 2, 2), np.pi)
    np.testing.assert_allclose(np.abs(tf.rotation_log(R)), np.pi * np.array([1, 2, 2]) / 3)


def test_projection_to_rotation_returns_a_rotation():
    noisy = np.eye(3) + np.random.default_rng(0).normal(0, 0.3, (3, 3))
    tf.as_transform(tf.make_transform(tf.project_to_rotation(noisy)))


@pytest.mark.parametrize(
    ("matrix", "complaint"),
    [
        (np.full((4, 4), np.nan), "not finite"),
        (np.eye(3), "shape"),
        (np.diag([1, 1, -1, 1.0]), "mirrors"),
        (np.diag([1, 1, 1.1, 1.0]), "orthonormal"),
        (np.eye(4) + np.eye(4)[[3, 0, 1, 2]] * 0.1, "last row"),
    ],
)
def test_what_is_not_a_transform_is_refused(matrix, complaint):
    with pytest.raises(InvalidTransformError, match=r"T_a_b") as caught:
        tf.as_transform(matrix, "T_a_b")
    assert complaint in str(caught.value) or "orthonormal" in str(caught.value)
