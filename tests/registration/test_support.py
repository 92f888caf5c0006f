import numpy as np
import pytest

from benchmarks.registration_objects import part
from reach.stable_poses import stable_poses
from reach.transforms import exp, inverse, make_transform, rotation_about
from registration.mesh_model import mesh_model
from registration.support import TOUCH, Support

UP = np.array([0.0, 0.0, 1.0])


def standing(name, pose=0):
    """A part on a table at z = 0 of the camera's frame, and the table's hold on it."""
    obj = part(name)
    T = stable_poses(obj)[pose].T_world_object
    support = Support(T[2, :3], mesh_model(obj).hull_vertices, UP, 0.0)
    return obj, T, support


def test_a_part_that_stands_ideally_is_not_pulled():
    _, T, support = standing("bracket")
    _, gradient = support.information(T)
    np.testing.assert_allclose(gradient * TOUCH**2, 0.0, atol=1e-8)


def test_a_lifted_and_tilted_part_is_pulled_back():
    _, T, support = standing("bracket")
    moved = make_transform(rotation_about((1, 2, 0), 2e-3), (0, 0, 4e-4)) @ T
    information, gradient = support.information(moved)
    back = moved @ exp(-np.linalg.pinv(information, rcond=1e-9) @ gradient)
    between = T @ inverse(back)
    assert abs(between[2, 3]) < 5e-6
    np.testing.assert_allclose(between[2, :3], UP, atol=2e-5)


def test_turning_and_sliding_on_the_table_are_free():
    _, T, support = standing("chiral_stair")
    information, _ = support.information(T)
    slid = np.concatenate([np.zeros(3), T[:3, :3].T @ [1.0, 0.5, 0.0]])
    turned = np.concatenate([T[:3, :3].T @ UP, np.zeros(3)])
    turned[3:] = T[:3, :3].T @ np.cross(T[:3, 3], UP)  # about the vertical through the origin
    for free in (slid, turned):
        assert free @ information @ free * TOUCH**2 < 1e-9


@pytest.mark.parametrize(("name", "held"), [("cube", True), ("pawn", False)])
def test_a_wide_foot_is_held_level_and_a_round_one_may_roll(name, held):
    obj = part(name)
    poses = stable_poses(obj)
    # The pawn lies on its head and the rim of its foot, and rolls; the cube stands on a face.
    lying = next(p for p in poses if held or abs(p.T_world_object[2, 2]) < 0.5)
    T = lying.T_world_object
    support = Support(T[2, :3], mesh_model(obj).hull_vertices, UP, 0.0)
    information, _ = support.information(T)
    R = np.zeros((6, 2))
    R[:3] = T[:3, :3].T @ np.eye(3)[:, :2]  # tilts about the table's x and y
    R[3:] = np.cross(obj.com, R[:3].T).T  # through the center of mass
    weakest = np.linalg.eigvalsh(R.T @ information @ R)[0]
    slack = np.degrees(1 / np.sqrt(weakest))
    assert (slack < 0.2) if held else (slack > 0.5)
