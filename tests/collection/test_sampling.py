from __future__ import annotations

from functools import lru_cache

import numpy as np
import pytest
import trimesh
from manifold3d import Manifold

from collection.errors import NoGraspError
from collection.objects import load_object
from collection.sampling import SampleResult, SamplingOptions, sample_grasps
from collection.sampling.antipodal import Surface, contact_pairs
from collection.sampling.approach import center_of_pads
from collection.sampling.distance import grasp_distance
from collection.sampling.over_poses import sample_over_poses
from collection.sampling.planning_mesh import MAX_DEVIATION, planning_mesh
from reach.gripper import ParallelJawGripper
from reach.objects import GraspObject
from reach.raycast import RaycastScene
from reach.stable_poses import StablePose, stable_poses
from reach.transforms import exp, inverse, make_transform

YUMI = ParallelJawGripper.yumi()
OPTIONS = SamplingOptions()
CENTER = center_of_pads(YUMI)
PARTS = ("cube_3cm", "bracket", "egg", "cup", "perforated_plate")


@lru_cache
def sampled(name: str, pose: int = 0, jitter: bool = True) -> SampleResult:
    part = load_object(name)
    options = OPTIONS if jitter else SamplingOptions(jitter=0.0)
    rng = np.random.default_rng(11)
    return sample_grasps(part, YUMI, stable_poses(part)[pose], count=20, rng=rng, options=options)


@pytest.fixture(params=PARTS)
def case(request) -> tuple[GraspObject, StablePose, SampleResult]:
    part = load_object(request.param)
    pose = 1 if request.param == "perforated_plate" else 0
    return part, stable_poses(part)[pose], sampled(request.param, pose)


def down_in_object(pose: StablePose) -> np.ndarray:
    return -pose.T_world_object[2, :3]


def test_contacts_are_on_the_surface_and_oppose_each_other(case):
    part, _, result = case
    assert len(result.grasps) == 20
    contacts = np.array([grasp.contacts_object for grasp in result.grasps])
    surface = RaycastScene(part.vertices, part.faces)
    assert surface.distance(contacts.reshape(-1, 3)).max() < 1e-6
    axes = contacts[:, 1] - contacts[:, 0]
    widths = np.linalg.norm(axes, axis=1)
    np.testing.assert_allclose(widths, [grasp.width for grasp in result.grasps])
    assert widths.min() >= OPTIONS.min_width
    assert widths.max() <= YUMI.max_opening - 2 * OPTIONS.opening_margin
    # A contact on an edge has several normals; the best one must oppose the other contact.
    for (first, second), axis in zip(contacts, axes / widths[:, None], strict=True):
        for point, direction in ((first, -axis), (second, axis)):
            on = np.linalg.norm(_nearest_on(part.triangles, point) - point, axis=1) < 2e-5
            angles = np.arccos(np.clip(part.face_normals[on] @ direction, -1, 1))
            assert angles.min() <= OPTIONS.normal_angle + 1e-4


def _nearest_on(triangles: np.ndarray, point: np.ndarray) -> np.ndarray:
    return trimesh.triangles.closest_point(triangles, np.tile(point, (len(triangles), 1)))


def test_the_parent_puts_the_contacts_between_the_pads(case):
    _, _, result = case
    for grasp in result.grasps:
        contacts = grasp.contacts_object
        center = (grasp.T_object_gripper_parent @ CENTER)[:3, 3]
        closing, _, approach = grasp.T_object_gripper_parent[:3, :3].T
        axis = (contacts[1] - contacts[0]) / grasp.width
        assert abs(closing @ axis) == pytest.approx(1, abs=1e-9)
        drawn_back = contacts.mean(axis=0) - center
        back = drawn_back @ approach
        np.testing.assert_allclose(drawn_back, back * approach, atol=1e-9)
        assert -1e-9 <= back <= YUMI.jaws[0].pad.polygon[:, 0].max()


def test_approaches_are_within_the_limit_of_straight_down(case):
    _, pose, result = case
    for grasp in result.grasps:
        angle = np.arccos(grasp.T_object_gripper[:3, 2] @ down_in_object(pose))
        assert angle == pytest.approx(grasp.approach_angle, abs=1e-7)
        assert angle <= OPTIONS.approach_angle + 1e-9


def test_jitter_stays_in_its_cube_and_turns_nothing(case):
    _, _, result = case
    half = YUMI.jaws[0].pad.width / 2
    offsets = []
    for grasp in result.grasps:
        offset = inverse(grasp.T_object_gripper_parent) @ grasp.T_object_gripper
        np.testing.assert_allclose(offset[:3, :3], np.eye(3), atol=1e-12)
        offsets.append(offset[:3, 3])
    assert np.abs(offsets).max() <= half
    assert np.abs(offsets).max(axis=0).min() > 0.4 * half, "every axis is jittered"


def test_neither_parent_nor_grasp_collides_with_part_or_table(case):
    part, pose, result = case
    solid = _manifold(part)
    for grasp in result.grasps:
        for T in (grasp.T_object_gripper, grasp.T_object_gripper_parent):
            hand = _hand(T)
            assert (hand ^ solid).volume() < 1e-12
            in_world = hand.transform(pose.T_world_object[:3])
            assert in_world.bounding_box()[2] >= OPTIONS.table_clearance - 1e-6


def _manifold(part: GraspObject) -> Manifold:
    from manifold3d import Mesh64

    return Manifold(Mesh64(np.array(part.vertices), part.faces.astype(np.uint64)))


def _hand(T: np.ndarray) -> Manifold:
    solid = Manifold()
    for box in YUMI.boxes():
        pose = np.asarray(T @ box.T_gripper_box)
        solid = solid + Manifold.cube(2 * box.half_extents, True).transform(pose[:3])
    return solid


def test_kept_grasps_are_farther_apart_than_the_threshold(case):
    _, _, result = case
    poses = np.array([grasp.T_object_gripper for grasp in result.grasps])
    distances = grasp_distance(poses[:, None], poses[None], CENTER)
    np.fill_diagonal(distances, np.inf)
    assert distances.min() > OPTIONS.min_distance


def test_every_candidate_is_accounted_for():
    part = load_object("bracket")
    few = SamplingOptions(max_candidates=4000)
    result = sample_grasps(
        part,
        YUMI,
        stable_poses(part)[0],
        count=10_000,
        rng=np.random.default_rng(0),
        reachable=lambda T: T[:, 0, 3] > 0,
        options=few,
    )
    assert result.candidates == 4000
    assert sum(result.discarded.values()) + len(result.grasps) == 4000
    assert result.discarded["out of the arm's reach"] > 0
    for grasp in result.grasps:
        T_world_gripper = stable_poses(part)[0].T_world_object @ grasp.T_object_gripper
        assert T_world_gripper[0, 3] > 0


def test_without_jitter_a_grasp_is_its_parent():
    for grasp in sampled("cube_3cm", jitter=False).grasps:
        np.testing.assert_array_equal(grasp.T_object_gripper, grasp.T_object_gripper_parent)


def test_jittered_grasps_that_miss_the_part_are_kept():
    part = load_object("cube_3cm")
    scene = RaycastScene(part.vertices, part.faces)
    misses = 0
    for grasp in sampled("cube_3cm").grasps:
        starts = np.array([(grasp.T_object_gripper @ YUMI.T_gripper_pad(j))[:3, 3] for j in (0, 1)])
        ahead = np.array([(grasp.T_object_gripper @ YUMI.T_gripper_pad(j))[:3, 2] for j in (0, 1)])
        misses += int(np.isinf(scene.cast(starts, ahead)[0]).any())
    assert misses > 0


def test_a_hollow_part_is_held_by_its_wall_and_across():
    widths = np.array([grasp.width for grasp in sampled("cup").grasps])
    assert (widths < 3e-3).any() and (widths > 25e-3).any()


def test_a_low_part_is_held_by_the_tips():
    part = load_object("perforated_plate")
    flat = stable_poses(part)[0]
    result = sample_grasps(
        part, YUMI, flat, count=1, rng=np.random.default_rng(1), options=SamplingOptions()
    )
    (grasp,) = result.grasps
    center = flat.T_world_object @ grasp.T_object_gripper_parent @ CENTER
    assert center[2, 3] > part.vertices[:, 2].max(), "the pads' middle is above the plate"


def test_the_same_seed_gives_the_same_grasps_and_more_only_append():
    part = load_object("knob")
    pose = stable_poses(part)[0]
    few, again, more = (
        sample_grasps(part, YUMI, pose, count=n, rng=np.random.default_rng(3)) for n in (6, 6, 12)
    )
    for a, b, c in zip(few.grasps, again.grasps, more.grasps, strict=False):
        np.testing.assert_array_equal(a.T_object_gripper, b.T_object_gripper)
        np.testing.assert_array_equal(a.T_object_gripper, c.T_object_gripper)
    other = sample_grasps(part, YUMI, pose, count=6, rng=np.random.default_rng(4))
    assert not np.array_equal(few.grasps[0].T_object_gripper, other.grasps[0].T_object_gripper)


def test_grasps_move_with_the_mesh():
    part = load_object("bracket")
    T = exp([0.7, -0.4, 1.1, 0.05, -0.1, 0.2])
    moved = GraspObject("bracket", part.vertices @ T[:3, :3].T + T[:3, 3], part.faces, part.mass)
    here = sample_grasps(part, YUMI, stable_poses(part)[0], count=10, rng=np.random.default_rng(5))
    there = sample_grasps(
        moved, YUMI, stable_poses(moved)[0], count=10, rng=np.random.default_rng(5)
    )
    for a, b in zip(here.grasps, there.grasps, strict=True):
        np.testing.assert_allclose(b.T_object_gripper, T @ a.T_object_gripper, atol=1e-6)


def test_rays_are_spread_over_the_cone_and_the_surface():
    cube = load_object("cube_3cm")
    pairs, discarded = contact_pairs(
        Surface.of(cube.vertices, cube.faces),
        20_000,
        np.random.default_rng(0),
        normal_angle=0.35,
        width_limits=(5e-4, 0.048),
    )
    starts = pairs.points[:, 0]
    side = np.abs(starts).argmax(axis=1) * 2 + (
        starts[np.arange(len(starts)), np.abs(starts).argmax(axis=1)] > 0
    )
    counts = np.bincount(side, minlength=6)
    assert counts.min() > 0.9 * counts.max()
    cosines = np.abs(pairs.axes).max(axis=1)
    # Uniform on the cap means uniform in the cosine; rays that leave by another side are gone,
    # the steeper the likelier, so the mean lies a little above the middle.
    middle = (1 + np.cos(0.35)) / 2
    assert middle < cosines.mean() < middle + 0.005
    assert set(discarded) <= {"single contact", "too wide", "too thin", "not antipodal"}


def test_distance_knows_no_left_and_right_jaw():
    rng = np.random.default_rng(0)
    half_turn = np.diag([-1.0, -1.0, 1.0, 1.0])
    for _ in range(20):
        T_a, T_b = exp(rng.normal(size=6) * 0.5), exp(rng.normal(size=6) * 0.5)
        there = grasp_distance(T_a, T_b, CENTER)
        assert grasp_distance(T_b, T_a, CENTER) == pytest.approx(there)
        assert grasp_distance(T_a @ half_turn, T_b, CENTER) == pytest.approx(there)
        T = exp(rng.normal(size=6))
        assert grasp_distance(T @ T_a, T @ T_b, CENTER) == pytest.approx(there)
    assert grasp_distance(T_a, T_a @ half_turn, CENTER) == pytest.approx(0, abs=1e-9)
    shifted = T_a @ make_transform(None, (0.003, 0, 0.004))
    assert grasp_distance(T_a, shifted, CENTER) == pytest.approx(0.005)


def test_a_scan_is_planned_on_fewer_faces_and_says_so(tmp_path, monkeypatch):
    monkeypatch.setenv("REACH_CACHE", str(tmp_path))
    ball = trimesh.creation.icosphere(6, radius=0.018)
    part = GraspObject("scan", ball.vertices, ball.faces, 0.01)
    assert len(part.faces) > 80_000
    light = planning_mesh(part)
    assert len(light.faces) <= 10_000
    assert "of its 81920 faces" in light.note
    gap = RaycastScene(part.vertices, part.faces).distance(light.vertices)
    assert gap.max() <= MAX_DEVIATION
    result = sample_grasps(part, YUMI, stable_poses(part)[0], count=3, rng=np.random.default_rng(0))
    assert len(result.grasps) == 3 and result.mesh_note == light.note


def test_a_part_that_cannot_be_held_is_refused_in_one_line():
    big = trimesh.creation.box((0.2, 0.2, 0.2))
    part = GraspObject("crate", big.vertices, big.faces, 1.0)
    quick = SamplingOptions(max_candidates=2000)
    with pytest.raises(NoGraspError) as refused:
        sample_over_poses(part, YUMI, stable_poses(part), count=3, seed=0, options=quick)
    message = str(refused.value)
    assert "'crate'" in message and "too wide" in message and "\n" not in message


def test_a_pose_without_grasps_is_left_out_and_named():
    bowl = load_object("bowl")
    samples = sample_over_poses(bowl, YUMI, stable_poses(bowl), count=15, seed=1)
    assert len(samples.grasps) == 15
    used = {pose.index for pose, _ in samples.grasps}
    for index, result in samples.searches.items():
        if not result.grasps:
            assert index not in used
            assert any(f"stable pose {index}" in note for note in samples.notes)
    assert any(not result.grasps for result in samples.searches.values())
