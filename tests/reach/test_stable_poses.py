from __future__ import annotations

import importlib.util
import os
from pathlib import Path

import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial import ConvexHull

from reach.errors import InvalidMeshError
from reach.hull import convex_hull
from reach.objects import GraspObject
from reach.stable_poses import resting_facets, stable_poses
from reach.transforms import exp


@pytest.fixture(autouse=True)
def fresh_cache(tmp_path_factory, monkeypatch):
    monkeypatch.setenv("REACH_CACHE", str(tmp_path_factory.mktemp("cache")))


def part(mesh: trimesh.Trimesh, T: np.ndarray | None = None, **kwargs: object) -> GraspObject:
    vertices = np.asarray(mesh.vertices)
    if T is not None:
        vertices = vertices @ T[:3, :3].T + T[:3, 3]
    return GraspObject("solid", vertices, mesh.faces, 0.01, **kwargs)


def random_solid(seed: int, corners: int = 14) -> trimesh.Trimesh:
    points = np.random.default_rng(seed).normal(size=(corners, 3)) * [0.02, 0.015, 0.01]
    return trimesh.Trimesh(points).convex_hull


def face_share(a: float, b: float, c: float) -> float:
    """Share of directions of one a x b face of a box, seen from its middle."""
    solid_angle = 4 * np.arctan(a * b / (c * np.sqrt(a * a + b * b + c * c)))
    return float(solid_angle / (4 * np.pi))


def test_a_box_rests_on_its_faces_by_their_solid_angles():
    a, b, c = 0.03, 0.04, 0.05
    poses = stable_poses(part(trimesh.creation.box((a, b, c))))
    expected = sorted(
        [2 * face_share(b, c, a), 2 * face_share(a, c, b), 2 * face_share(a, b, c)], reverse=True
    )
    assert [pose.probability for pose in poses] == pytest.approx(expected, abs=1e-9)
    heights = [pose.T_world_object[2, 3] for pose in poses]
    assert heights == pytest.approx([a / 2, b / 2, c / 2])
    assert [pose.index for pose in poses] == [0, 1, 2]


def test_symmetric_poses_are_one():
    poses = stable_poses(part(trimesh.creation.box((0.03, 0.03, 0.03))))
    assert [pose.probability for pose in poses] == pytest.approx([1.0])


def test_a_face_beside_the_center_of_mass_is_toppled_over():
    leaning = trimesh.creation.extrude_triangulation(
        [(0, 0), (0.01, 0), (0.05, 0.04), (0.04, 0.04)], [(0, 1, 2), (0, 2, 3)], 0.02
    )
    feet = [pose.T_world_object[2, :3] for pose in stable_poses(part(leaning), 0.0)]
    assert not any(up[1] > 0.99 for up in feet), "its foot is not below its center of mass"


@settings(max_examples=30, deadline=None)
@given(seed=st.integers(0, 10_000))
def test_probabilities_sum_to_one_and_facets_support_the_center(seed):
    mesh = random_solid(seed)
    hull = convex_hull(np.asarray(mesh.vertices), mesh.center_mass)
    assert hull.solid_angles.sum() == pytest.approx(1, abs=1e-9)
    facets, probabilities = resting_facets(hull, hump=0.0)
    assert probabilities.sum() == pytest.approx(1, abs=1e-9)
    assert (hull.insets[facets] > -1e-9).all(), "the center's foot lies in a resting facet"


@pytest.mark.parametrize("seed", range(8))
def test_agrees_with_trimesh_on_random_solids(seed):
    mesh = random_solid(seed)
    hull = convex_hull(np.asarray(mesh.vertices), mesh.center_mass)
    facets, probabilities = resting_facets(hull, hump=0.0)
    transforms, reference = mesh.compute_stable_poses(seed=0)
    assert len(reference) == len(probabilities), "the same facets are stable"
    order = np.argsort(-probabilities)
    ours = dict(zip(facets[order], probabilities[order], strict=True))
    for T, expected in zip(transforms, reference, strict=True):
        facet = facets[np.argmax(hull.normals[facets] @ -T[2, :3])]
        assert ours[facet] == pytest.approx(expected, abs=1e-9)


@pytest.mark.parametrize("seed", range(5))
def test_a_pose_lies_on_the_table_with_its_center_over_the_support(seed):
    solid = part(random_solid(seed), exp([0.4, 0.2, -0.7, 0.5, 0.1, 0.2]))
    for pose in stable_poses(solid, 0.0):
        T = pose.T_world_object
        points = solid.vertices @ T[:3, :3].T + T[:3, 3]
        assert points[:, 2].min() == pytest.approx(0, abs=1e-12)
        center = T[:3, :3] @ solid.com + T[:3, 3]
        assert center[:2] == pytest.approx([0, 0], abs=1e-12)
        support = points[points[:, 2] < 1e-9, :2]
        assert ConvexHull(support).equations[:, 2].max() <= 1e-9


def test_a_round_bar_rolls_over_its_facets_but_a_hexagon_does_not():
    def sides(sections: int) -> int:
        mesh = trimesh.creation.cylinder(0.013, 0.05, sections=sections)
        hull = convex_hull(np.asarray(mesh.vertices), np.zeros(3))
        facets, _ = resting_facets(hull)
        return int((np.abs(hull.normals[facets, 2]) < 0.5).sum())

    # A pose about every 15 degrees, which the bar's symmetry then makes one.
    assert 12 <= sides(64) <= 24
    assert sides(6) == 6
    bar = trimesh.creation.cylinder(0.013, 0.05, sections=64)
    assert len(stable_poses(part(bar), 0.0)) == 2


def test_a_keyed_roller_has_poses_all_around_it():
    roller = trimesh.creation.cylinder(0.013, 0.05, sections=64)
    key = trimesh.creation.box((0.004, 0.004, 0.06))
    key.apply_translation([0.007, 0, 0])
    keyed = part(trimesh.boolean.difference([roller, key], engine="manifold"))
    ways = [pose.T_world_object[2, :3] for pose in stable_poses(keyed, 0.0)]
    around = np.sort([np.arctan2(up[1], up[0]) for up in ways if abs(up[2]) < 0.5])
    gaps = np.diff(np.append(around, around[0] + 2 * np.pi))
    assert np.degrees(gaps.max()) <= 31, "every way it rolls is within 15 degrees of a pose"


def test_less_probable_poses_are_left_out_on_demand():
    rod = part(trimesh.creation.box((0.01, 0.011, 0.06)))
    every = stable_poses(rod, 0.0)
    assert sum(pose.probability for pose in every) == pytest.approx(1)
    likely = stable_poses(rod, 0.1)
    assert len(every) == 3 and len(likely) == 2
    assert [p.probability for p in likely] == [p.probability for p in every[:2]]


@pytest.mark.parametrize("seed", range(4))
def test_a_moved_mesh_has_the_same_poses(seed):
    mesh = random_solid(seed)
    T = exp([0.4, -1.2, 0.7, 0.5, 0.1, 0.2])
    here, there = stable_poses(part(mesh), 0.0), stable_poses(part(mesh, T), 0.0)
    assert [p.probability for p in there] == pytest.approx([p.probability for p in here])
    for a, b in zip(here, there, strict=True):
        up_a, up_b = a.T_world_object[2, :3], b.T_world_object[2, :3]
        np.testing.assert_allclose(up_b @ T[:3, :3], up_a, atol=1e-7)


def test_the_cache_knows_the_center_of_mass():
    mesh = trimesh.creation.box((0.02, 0.02, 0.06))
    plain = stable_poses(part(mesh), 0.0)
    again = stable_poses(part(mesh), 0.0)
    loaded = stable_poses(part(mesh, center_of_mass=(0, 0, -0.02)), 0.0)
    for a, b in zip(plain, again, strict=True):
        assert a.probability == b.probability
        np.testing.assert_array_equal(a.T_world_object, b.T_world_object)
    assert [p.probability for p in loaded] != pytest.approx([p.probability for p in plain])


def test_a_center_of_mass_outside_the_hull_is_refused():
    adrift = part(trimesh.creation.box((0.02, 0.02, 0.02)), center_of_mass=(0.05, 0, 0))
    with pytest.raises(InvalidMeshError, match="outside"):
        stable_poses(adrift)


@pytest.mark.slow
def test_dropped_parts_come_to_rest_where_predicted():
    benchmark = _benchmark("stable_poses")
    drops = 300 if os.environ.get("REACH_SLOW") == "1" else 60
    for name in ("near_cube", "cup", "cylinder"):
        result = benchmark.compare(benchmark.load_object(name), drops, seed=1, height=0.005)
        assert result.rank_correlation > 0.4, name
        assert result.elsewhere < 0.05, name
        assert result.total_variation < 0.2, name


def _benchmark(name: str):
    path = Path(__file__).parents[2] / "benchmarks" / f"{name}.py"
    spec = importlib.util.spec_from_file_location(f"benchmark_{name}", path)
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    import sys

    sys.modules[spec.name] = module
    spec.loader.exec_module(module)
    return module
