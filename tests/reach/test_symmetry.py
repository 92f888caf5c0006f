from __future__ import annotations

import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st

from reach.objects import GraspObject
from reach.symmetry import Symmetry, pose_distance, symmetry
from reach.transforms import exp, make_transform, rotation_about


@pytest.fixture(autouse=True)
def fresh_cache(tmp_path_factory, monkeypatch):
    monkeypatch.setenv("REACH_CACHE", str(tmp_path_factory.mktemp("cache")))


def part(mesh: trimesh.Trimesh, T: np.ndarray | None = None, **kwargs: object) -> GraspObject:
    vertices = np.asarray(mesh.vertices)
    if T is not None:
        vertices = vertices @ T[:3, :3].T + T[:3, 3]
    return GraspObject("solid", vertices, mesh.faces, 0.01, **kwargs)


def box(*edges: float) -> trimesh.Trimesh:
    return trimesh.creation.box(np.array(edges) * 1e-3)


def prism(sides: int, radius: float = 0.015, height: float = 0.05) -> trimesh.Trimesh:
    return trimesh.creation.cylinder(radius, height, sections=sides)


def tetrahedron() -> trimesh.Trimesh:
    corners = np.array([(1, 1, 1), (1, -1, -1), (-1, 1, -1), (-1, -1, 1)]) * 0.02
    return trimesh.Trimesh(corners, [(0, 2, 1), (0, 1, 3), (0, 3, 2), (1, 2, 3)]).convex_hull


def icosahedron() -> trimesh.Trimesh:
    mesh = trimesh.creation.icosahedron()
    mesh.apply_scale(0.02)
    return mesh


def mirrored_bracket() -> trimesh.Trimesh:
    """An L with a mirror plane and no rotation."""
    outline = [(0, 0), (0.05, 0), (0.05, 0.005), (0.005, 0.005), (0.005, 0.038), (0, 0.038)]
    from shapely.geometry import Polygon

    return trimesh.creation.extrude_polygon(Polygon(outline), 0.024)


TURNED = exp([0.3, -0.8, 0.5, 0.2, -0.1, 0.3])


@pytest.mark.parametrize("T", [np.eye(4), TURNED], ids=["square", "turned"])
@pytest.mark.parametrize(
    ("solid", "order"),
    [
        (lambda: box(30, 30, 30), 24),
        (lambda: box(30, 40, 50), 4),
        (lambda: box(30, 30, 50), 8),
        (lambda: box(30, 31, 50), 4),  # the sides differ by 1 mm: no quarter turn
        (lambda: prism(6), 12),
        (lambda: prism(5), 10),
        (lambda: prism(12), 24),  # twelve facets of a 30 mm bar are no circle
        (tetrahedron, 12),
        (icosahedron, 60),
        (mirrored_bracket, 1),
    ],
    ids="cube box square-box near-square hexagon pentagon dodecagon tetra icosa bracket".split(),
)
def test_finite_groups_of_known_solids(solid, order, T):
    found = symmetry(part(solid(), T))
    assert found.axis is None and not found.sphere
    assert len(found.rotations) == order


@pytest.mark.parametrize(
    ("solid", "flips"),
    [
        (lambda: prism(64), True),
        (lambda: prism(64, 0.02, 0.02 * np.sqrt(3)), True),  # its three moments are equal
        (lambda: trimesh.creation.cone(0.02, 0.05, sections=64), False),
        (lambda: trimesh.creation.capsule(0.03, 0.01, count=[32, 32]), True),
    ],
    ids=["cylinder", "isotropic-cylinder", "cone", "capsule"],
)
def test_parts_of_revolution_have_an_axis(solid, flips):
    found = symmetry(part(solid(), TURNED))
    assert found.axis is not None
    assert abs(found.axis @ TURNED[:3, 2]) == pytest.approx(1, abs=1e-4)
    assert len(found.rotations) == (2 if flips else 1)
    if flips:
        np.testing.assert_allclose(found.rotations[1] @ found.axis, -found.axis, atol=1e-6)


def test_a_sphere_is_a_sphere():
    assert symmetry(part(trimesh.creation.icosphere(3, radius=0.02))).sphere


def test_an_off_center_mass_leaves_the_turns_that_keep_it_in_place():
    ballasted = part(box(30, 30, 30), center_of_mass=(0.004, 0, 0))
    found = symmetry(ballasted)
    assert len(found.rotations) == 4
    np.testing.assert_allclose(found.rotations @ [1, 0, 0], np.tile([1, 0, 0], (4, 1)), atol=1e-9)


def test_the_rotations_are_a_group_that_maps_corners_to_corners():
    cube = part(box(30, 30, 30), TURNED)
    found = symmetry(cube)
    np.testing.assert_array_equal(found.rotations[0], np.eye(3))
    for T in found.transforms(cube):
        moved = cube.vertices @ T[:3, :3].T + T[:3, 3]
        gaps = np.linalg.norm(moved[:, None] - cube.vertices[None], axis=2).min(axis=1)
        assert gaps.max() < 1e-6
    products = np.einsum("aij,bjk->abik", found.rotations, found.rotations).reshape(-1, 3, 3)
    distances = np.linalg.norm(products[:, None] - found.rotations[None], axis=(2, 3))
    assert distances.min(axis=1).max() < 1e-5


def test_a_small_feature_breaks_the_symmetry():
    cube = box(30, 30, 30)
    bump = trimesh.creation.cylinder(0.002, 0.004, sections=16)
    bump.apply_translation([0.008, 0.005, 0.016])
    joined = trimesh.boolean.union([cube, bump], engine="manifold")
    assert len(symmetry(part(joined)).rotations) == 1


poses = st.lists(st.floats(-2, 2), min_size=6, max_size=6).map(exp)


@settings(max_examples=40, deadline=None)
@given(T=poses, shift=st.floats(0, 0.02), angle=st.floats(0, 0.5), which=st.integers(0, 23))
def test_distance_ignores_symmetry_and_measures_the_rest(cube_symmetry, T, shift, angle, which):
    sym = cube_symmetry
    moved = T @ exp([0, 0, angle, 0, 0, 0]) @ make_transform(None, (shift, 0, 0))
    rotation, translation = pose_distance(sym, T, moved @ sym.transforms()[which])
    assert rotation == pytest.approx(angle, abs=1e-6)
    assert translation == pytest.approx(shift, abs=1e-9)
    back = pose_distance(sym, moved @ sym.transforms()[which], T)
    assert back == pytest.approx((rotation, translation), abs=1e-6)


@pytest.fixture(scope="module")
def cube_symmetry() -> Symmetry:
    axes = [rotation_about(a, k * np.pi / 2) for a in np.eye(3) for k in range(4)]
    group: list[np.ndarray] = []
    for product in (a @ b @ c for a in axes for b in axes for c in axes):
        if all(np.abs(product - other).max() > 1e-6 for other in group):
            group.append(product)
    assert len(group) == 24
    return Symmetry(np.array(group), None, np.zeros(3))


@settings(max_examples=40, deadline=None)
@given(T=poses, spin=st.floats(-3, 3), tilt=st.floats(0, 1.5))
def test_distance_of_a_round_part_is_the_tilt_of_its_axis(T, spin, tilt):
    sym = Symmetry(np.eye(3)[None], np.array([0, 0, 1.0]), np.array([0, 0, 0.01]))
    about_center = make_transform(None, sym.center)
    moved = T @ about_center @ exp([tilt, 0, 0, 0, 0, 0]) @ exp([0, 0, spin, 0, 0, 0])
    moved = moved @ make_transform(None, -sym.center)
    rotation, translation = pose_distance(sym, T, moved)
    assert rotation == pytest.approx(tilt, abs=1e-6)
    assert translation == pytest.approx(0, abs=1e-9)


def test_a_sphere_has_no_rotation_distance():
    sym = Symmetry(np.eye(3)[None], None, np.zeros(3), sphere=True)
    T_b = exp([1, 2, 3, 0, 0, 0]) @ make_transform(None, (0, 0.003, 0))
    assert pose_distance(sym, np.eye(4), T_b) == pytest.approx((0, 0.003))
