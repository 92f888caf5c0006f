from __future__ import annotations

import numpy as np
import pytest
import trimesh
from manifold3d import Manifold

from reach.collision import CollisionChecker, box_touches_triangle
from reach.gripper import Box, ParallelJawGripper
from reach.objects import GraspObject
from reach.transforms import exp, make_transform

YUMI = ParallelJawGripper.yumi()


def clipped(half: np.ndarray, corners: np.ndarray) -> np.ndarray:
    """What is left of a triangle within a box, by cutting it with the box's six planes."""
    polygon = list(corners)
    for axis in range(3):
        for sign in (1.0, -1.0):
            kept: list[np.ndarray] = []
            for a, b in zip(polygon, polygon[1:] + polygon[:1], strict=True):
                da, db = half[axis] - sign * a[axis], half[axis] - sign * b[axis]
                if da >= 0:
                    kept.append(a)
                if (da > 0 > db) or (da < 0 < db):
                    kept.append(a + (b - a) * da / (da - db))
            polygon = kept
            if not polygon:
                return np.zeros((0, 3))
    return np.array(polygon)


def test_box_and_triangle_agree_with_clipping():
    rng = np.random.default_rng(3)
    half = np.array([0.6, 1.0, 1.5])
    touching = 0
    for _ in range(3000):
        corners = rng.normal(size=3) * 1.5 + rng.normal(size=(3, 3)) * rng.uniform(0.1, 2)
        expected = len(clipped(half, corners)) > 0
        assert box_touches_triangle(half, corners) == expected
        touching += expected
    assert 500 < touching < 2500


def gripper_solid(T: np.ndarray, approach: float = 0.0) -> Manifold:
    solid = Manifold()
    for box in YUMI.boxes():
        size = 2 * box.half_extents + [0, 0, approach]
        pose = T @ box.T_gripper_box @ make_transform(None, (0, 0, -approach / 2))
        solid = solid + Manifold.cube(size, True).transform(pose[:3])
    return solid


@pytest.mark.parametrize("approach", [0.0, 0.05])
def test_the_hand_collides_where_the_solids_overlap(approach):
    bowl = Manifold.sphere(0.03, 32) - Manifold.sphere(0.024, 32)
    bowl = bowl.trim_by_plane((0, 0, -1), -0.005)
    mesh = bowl.to_mesh64()
    part = GraspObject("bowl", mesh.vert_properties, mesh.tri_verts, 0.01)
    rng = np.random.default_rng(5)
    poses = np.array(
        [
            make_transform(None, rng.uniform(-0.04, 0.04, 3))
            @ exp([*rng.normal(size=3), 0, 0, 0])
            @ make_transform(None, (0, 0, -0.15))
            for _ in range(300)
        ]
    )
    hits = CollisionChecker.of(part, YUMI, approach).hits_object(poses)
    volumes = [(gripper_solid(T, approach) ^ bowl).volume() for T in poses]
    apart = np.array([volume == 0 for volume in volumes])
    overlapping = np.array([volume > 1e-10 for volume in volumes])
    assert not hits[apart].any() and hits[overlapping].all()
    assert (apart | overlapping).mean() > 0.97
    assert 30 < hits.sum() < 270


def test_a_finger_wholly_inside_a_solid_is_a_hit():
    block = trimesh.creation.box((0.9, 0.9, 0.9))
    part = GraspObject("block", block.vertices, block.faces, 1.0)
    assert CollisionChecker.of(part, YUMI).hits_object(np.eye(4)[None]).all()


def test_a_box_askew_is_swept_in_steps():
    turned = Box(
        make_transform(None, (0, 0, 0.1)) @ exp([0.0, 0.5, 0.0, 0, 0, 0]),
        np.array([0.004, 0.004, 0.02]),
    )
    hand = ParallelJawGripper("stick", YUMI.jaws, 0.025, 20.0, 0.02, palm=(turned,))
    needle = trimesh.creation.box((0.02, 0.02, 0.02))
    needle.apply_translation([0, 0, 0.04])
    part = GraspObject("needle", needle.vertices, needle.faces, 0.01)
    pose = np.eye(4)[None]
    assert not CollisionChecker.of(part, hand, 0.0).hits_object(pose).any()
    assert CollisionChecker.of(part, hand, 0.05).hits_object(pose).all()


def test_lowest_point_is_the_lowest_corner():
    cube = trimesh.creation.box((0.03,) * 3)
    checker = CollisionChecker.of(GraspObject("cube", cube.vertices, cube.faces, 0.01), YUMI)
    rng = np.random.default_rng(0)
    poses = np.array([exp([*rng.normal(size=3), 0.1, 0, 0.3]) for _ in range(20)])
    signs = np.array(np.meshgrid(*[[-1, 1]] * 3)).reshape(3, -1).T
    for T, low in zip(poses, checker.lowest_point(poses), strict=True):
        corners = [
            (T @ box.T_gripper_box @ np.append(sign * box.half_extents, 1))[2]
            for box in YUMI.boxes()
            for sign in signs
        ]
        assert low == pytest.approx(min(corners))
