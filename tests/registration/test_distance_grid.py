import numpy as np
import pytest

from reach.transforms import exp, make_transform, rotation_about
from registration.mesh_model import mesh_model
from registration.sdf import distance_and_gradient


def box_distance(points: np.ndarray, half: float) -> np.ndarray:
    """Exact signed distance of an axis-aligned cube about the origin."""
    q = np.abs(points) - half
    outside = np.linalg.norm(np.maximum(q, 0), axis=1)
    return outside + np.minimum(q.max(axis=1), 0)


def test_distances_to_a_cube_are_exact_to_the_grid(parts):
    model = mesh_model(parts["cube"])
    points = np.random.default_rng(0).uniform(-0.008, 0.038, (500, 3))
    found = model.distances(points, np.eye(4)[None])[0]
    exact = box_distance(points - 0.015, 0.015)
    assert np.abs(found - exact).max() < 0.6 * model.sdf.spacing
    assert np.median(np.abs(found - exact)) < 1e-5


def test_far_points_know_the_way_back(parts):
    sdf = mesh_model(parts["cube"]).sdf
    d, gx, gy, gz = distance_and_gradient(
        sdf.values, sdf.origin, 1 / sdf.spacing, 0.3, 0.015, 0.015
    )
    assert d == pytest.approx(0.27, abs=1e-3)
    assert (gx, gy, gz) == pytest.approx((1, 0, 0), abs=1e-6)


def test_the_gradient_is_that_of_the_interpolated_distance(parts):
    sdf = mesh_model(parts["mug"]).sdf

    def at(p):
        return distance_and_gradient(sdf.values, sdf.origin, 1 / sdf.spacing, *p)

    step = 1e-8
    for p in np.random.default_rng(1).uniform(0.0, 0.02, (50, 3)):
        cell = (p - sdf.origin) / sdf.spacing
        if np.abs(cell - np.round(cell)).min() < 1e-3:
            continue  # the interpolation has a kink there
        for axis in range(3):
            q = p.copy()
            q[axis] += step
            slope = (at(q)[0] - at(p)[0]) / step
            assert slope == pytest.approx(at(p)[1 + axis], abs=1e-4)


def test_symmetric_poses_have_no_distance_and_others_do(parts):
    cube = mesh_model(parts["cube"])
    center = parts["cube"].com
    quarter = rotation_about((0, 0, 1), np.pi / 2)
    eighth = rotation_about((0, 0, 1), np.pi / 4)
    T = exp([0.3, -0.2, 0.5, 0.01, 0.02, 0.03])
    turned = [make_transform(R, center - R @ center) for R in (quarter, eighth)]
    same, other = cube.surface_distances(T, np.stack([T @ S for S in turned]))
    assert same < 2e-4
    # A corner of the square section sticks out by (sqrt(2) - 1) * 15 mm, 45 degrees to a face.
    assert other == pytest.approx((np.sqrt(2) - 1) * 0.015, rel=0.1)


def test_the_distance_of_poses_is_two_way(parts):
    model = mesh_model(parts["chiral_stair"])
    T = np.eye(4)
    moved = make_transform(None, (0.007, 0, 0))
    assert model.surface_distance(T, moved) == pytest.approx(
        model.surface_distance(moved, T), abs=1e-9
    )
    assert model.surface_distance(T, moved) == pytest.approx(0.007, abs=5e-4)
