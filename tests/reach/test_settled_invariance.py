"""What must not change the settled model's verdict, and how its batch, score and record agree."""

import json

import numpy as np
import pytest
import trimesh

from reach import Grasp, GraspObject, ParallelJawGripper, PoseError, Scene, SettledContact
from reach import transforms as tf
from reach.errors import InvalidInputError
from reach.gripper import Jaw
from reach.kernels.settle_press import press, pressed
from reach.models.registry import make_scorer
from reach.models.settled import Settled
from reach.models.settled_grade import GRADE, Grade
from reach.models.settled_score import SettledRobustScorer, SettledScorer
from reach.models.settled_verdict import Fate

YUMI = ParallelJawGripper.yumi()
MODEL = SettledContact(friction=0.35)


def dented_ball(subdivisions=3):
    mesh = trimesh.creation.icosphere(subdivisions, 0.018)
    mesh.vertices *= 1 + 0.1 * np.sin(250 * mesh.vertices[:, [1, 2, 0]])
    return mesh


def meshes():
    rng = np.random.default_rng(5)
    yield trimesh.creation.box((0.03, 0.022, 0.03))
    yield trimesh.convex.convex_hull(rng.uniform(-0.02, 0.02, (15, 3)))
    yield dented_ball()


def part_of(mesh, mass=0.05):
    return GraspObject("part", mesh.vertices, mesh.faces, mass)


def grasps(count=6, seed=3):
    """Hands that come straight down, turned and shifted."""
    rng = np.random.default_rng(seed)
    for _ in range(count):
        down = tf.rotation_about((0, 0, 1), rng.uniform(-3, 3)) @ np.diag([1.0, -1.0, -1.0])
        shift = rng.uniform(-0.006, 0.006, 3) + (0, 0, 0.160)
        yield Grasp(tf.make_transform(down, shift))


def assert_same(a, b, rel=1e-6):
    assert a.settlement.fate is b.settlement.fate
    assert a.margin == pytest.approx(b.margin, rel=rel, abs=rel)
    assert a.settlement.translation == pytest.approx(b.settlement.translation, rel=rel, abs=1e-6)
    assert a.settlement.yaw == pytest.approx(b.settlement.yaw, rel=rel, abs=1e-4)


@pytest.mark.parametrize("mesh", list(meshes()), ids=["box", "hull", "ball"])
def test_moving_world_and_part_together_changes_nothing(mesh):
    part = part_of(mesh)
    shift = tf.exp(np.array([0.4, -1.1, 0.7, 0.2, -0.1, 0.3]))
    turned = GraspObject("turned", tf.apply(shift, part.vertices), part.faces, part.mass)
    pose = tf.make_transform(tf.rotation_about((0, 0, 1), 0.8), (0.3, 0.1, 0.02))
    for grasp in grasps():
        here = MODEL.evaluate(Scene(part, YUMI, np.eye(4)), grasp)
        there = MODEL.evaluate(
            Scene(turned, YUMI, pose @ tf.inverse(shift)), Grasp(shift @ grasp.T_object_gripper)
        )
        assert_same(here, there, rel=1e-4)


def test_order_of_the_jaws_changes_nothing():
    swapped = ParallelJawGripper("swapped", YUMI.jaws[::-1], 0.025, 20.0, 0.02)
    for mesh in meshes():
        for grasp in grasps(3):
            one = MODEL.evaluate(Scene(part_of(mesh), YUMI, np.eye(4)), grasp)
            other = MODEL.evaluate(Scene(part_of(mesh), swapped, np.eye(4)), grasp)
            assert_same(one, other, rel=1e-4)


def test_cutting_the_mesh_finer_changes_nothing():
    for mesh in meshes():
        fine = mesh.subdivide().subdivide()
        for grasp in grasps():
            coarse = MODEL.evaluate(Scene(part_of(mesh), YUMI, np.eye(4)), grasp)
            finer = MODEL.evaluate(Scene(part_of(fine), YUMI, np.eye(4)), grasp)
            assert coarse.settlement.fate is finer.settlement.fate
            # Triangles go whole or in pieces to the cells of friction: a part may rest a step apart.
            assert coarse.settlement.yaw == pytest.approx(finer.settlement.yaw, abs=0.045)
            assert coarse.settlement.translation == pytest.approx(
                finer.settlement.translation, abs=1.3e-3
            )


def test_batch_agrees_with_single_verdicts():
    scene = Scene(part_of(dented_ball()), YUMI, np.eye(4))
    listed = list(grasps(12))
    batch = MODEL.evaluate_batch(scene, np.array([g.T_object_gripper for g in listed]))
    singles = [MODEL.evaluate(scene, grasp) for grasp in listed]
    assert batch.margin.tolist() == [v.margin for v in singles]
    assert batch.reasons() == tuple(v.reason for v in singles)
    assert {v.settlement.fate for v in singles} != {Fate.NO_CONTACT}


def test_pressing_columns_matches_numeric_integration():
    """One slanted triangle: area, force and energy as functions of depth, layer and backing."""
    columns = np.array([[2e-5, 0.001, 0.0025, 0.004]])
    u, v = (a.ravel() for a in np.meshgrid(*[(np.arange(1500) + 0.5) / 1500] * 2))
    z = 0.001 + np.where(u + v < 1, u * 0.0015 + v * 0.003, np.nan)
    z = z[np.isfinite(z)]
    for depth in (0.0005, 0.0018, 0.0029, 0.006):
        delta = np.maximum(0.0, depth - z)
        expected = 2e-5 * np.array([(delta > 0).mean(), delta.mean(), (delta**2).mean() / 2])
        assert pressed(1, columns, depth) == pytest.approx(expected, rel=2e-3, abs=1e-15)
    for force in (0.5, 5.0, 20.0, 40.0):
        depth, energy, factor = press(1, columns, force, 1.5e8, 5.3e-3)
        layers = [(1.5e8, depth), (20 * 1.5e8, depth - 5.3e-3)]
        assert factor == pytest.approx(1.0, rel=1e-6)
        push = sum(k * 2e-5 * np.maximum(0, d - z).mean() for k, d in layers)
        assert push == pytest.approx(force, rel=2e-3)
        stored = sum(k * 2e-5 * (np.maximum(0, d - z) ** 2).mean() / 2 for k, d in layers)
        assert energy == pytest.approx(stored, rel=4e-3)


def test_three_jaws_hold_a_rod():
    mesh = trimesh.creation.cylinder(0.015, 0.04, sections=48)
    pad, jaws = YUMI.jaws[0].pad, []
    for turn in (0.0, 2 * np.pi / 3, 4 * np.pi / 3):
        inward, x = np.array([np.cos(turn), np.sin(turn), 0.0]), np.array([0.0, 0.0, -1.0])
        rotation = np.column_stack([x, np.cross(inward, x), inward])
        jaws.append(Jaw(pad, tf.make_transform(rotation, -0.025 * inward)))
    gripper = ParallelJawGripper("three", tuple(jaws), 0.025, 20.0, 0.02)
    verdict = MODEL.evaluate(Scene(part_of(mesh), gripper, np.eye(4)), Grasp(np.eye(4)))
    assert verdict.resists and len(verdict.patches) == 3


def test_nominal_score_keeps_the_path_for_the_record():
    scorer = make_scorer("settled", friction=0.3)
    assert isinstance(scorer, SettledScorer)
    scene = Scene(part_of(trimesh.creation.box((0.03, 0.03, 0.03))), YUMI, np.eye(4))
    down = tf.rotation_about((0, 0, 1), 0.3) @ np.diag([1.0, -1.0, -1.0])
    grasp = Grasp(tf.make_transform(down, (0, 0, 0.16)))
    score = scorer.score(scene, grasp)
    details = json.loads(json.dumps(score.details))
    path = np.array(details["path"])
    assert 2 < len(path) <= 12 and path.shape[1:] == (4, 4)
    np.testing.assert_allclose(path[0], np.eye(4), atol=1e-12)
    turned = np.arctan2(path[-1][1, 0], path[-1][0, 0])
    assert abs(turned) == pytest.approx(details["yaw"], abs=0.02) and abs(turned) > 0.2
    assert np.allclose(path[:, 2, :2], 0, atol=1e-9)  # it stays flat on the table
    assert scorer.score_many(scene, [grasp])[0].value == score.value


def test_robust_score_is_graded_reproducible_and_rises_with_a_better_hold():
    scorer = make_scorer("settled-robust", samples=40)
    assert isinstance(scorer, SettledRobustScorer)
    scene = Scene(part_of(trimesh.creation.box((0.03, 0.03, 0.03))), YUMI, np.eye(4))
    down = np.diag([1.0, -1.0, -1.0])
    error = PoseError.isotropic(translation=0.001, rotation=0.01)
    listed = [Grasp(tf.make_transform(down, (0, y, 0.16))) for y in (0.0, 0.018, 0.0235, 0.1)]
    scores = scorer.score_many(scene, listed, pose_error=error, seed=4)
    values = [score.value for score in scores]
    assert values == sorted(values, reverse=True) and values[0] > values[2] > values[3]
    assert values[0] > 0.9 and values[3] < 0.25
    assert scores[1].value == scorer.score(scene, listed[1], pose_error=error, seed=4).value
    assert sum(scores[0].details["counts"].values()) == 40
    plain = make_scorer("settled-robust", samples=40, graded=False)
    share = plain.score(scene, listed[2], pose_error=error, seed=4)
    assert share.value == share.details["share"] == scores[2].details["share"]
    assert plain.parameters["grade"] == "none" != scorer.parameters["grade"]


def told(held, inside):
    """Settled samples of which some hold, all pressed at one distance inside the outline [m]."""
    count = len(held)
    features = np.zeros((count, 10))
    features[:, 5] = inside
    nothing = np.zeros(count, np.int64)
    margin = np.where(held, 10.0, 0.0)
    return Settled(margin, nothing, nothing, np.ones((count, 2)), features, np.empty((0, 4, 4)), 0)


def test_the_grade_rises_with_the_share_that_holds_and_with_the_distance_from_the_rim():
    share = [GRADE.rate(YUMI, told(np.arange(100) < k, 0.003)) for k in range(0, 101, 5)]
    assert np.all(np.diff(share) >= 0) and np.all(np.diff(share[:18]) > 0)
    assert share[0] < 0.05 and share[-1] == 1.0
    rim = [GRADE.rate(YUMI, told(np.arange(100) < 60, d)) for d in np.linspace(-1e-3, 5e-3, 20)]
    assert np.all(np.diff(rim) >= 0) and rim[-1] > rim[0] + 0.2


@pytest.mark.parametrize("samples", [20, 100])
@pytest.mark.parametrize("share", [0.0, 0.35, 0.8, 0.95])
def test_the_grade_is_the_median_of_alike_grasps_told_in_whole_samples(share, samples):
    """Against Beta-distributed rates drawn at random."""
    grade = Grade(offset=-0.5, share=0.8, inside=3.0, alike=6.0)
    held = round(share * samples)
    value = grade.rate(YUMI, told(np.arange(samples) < held, 0.002))
    assert round(value * samples) == pytest.approx(value * samples)
    odds = (held + 0.5) / (samples - held + 0.5)
    inside = 0.002 / (0.5 * YUMI.jaws[0].pad.width) if held else 0.0
    mean = 1.0 / (1.0 + np.exp(0.5 - 3.0 * inside) * odds**-0.8)
    rates = np.random.default_rng(1).beta(6.0 * mean, 6.0 * (1.0 - mean), 40000)
    assert value == pytest.approx(np.median(rates), abs=0.5 / samples + 0.006)


def test_the_less_grasps_are_alike_the_nearer_is_the_score_to_yes_or_no():
    most = told(np.arange(100) < 90, 0.003)
    values = [Grade(0.0, 1.0, 0.0, alike).rate(YUMI, most) for alike in (1000.0, 5.0, 0.5)]
    assert values[0] == pytest.approx(0.9, abs=0.011)
    assert values[0] < values[1] < values[2] == 1.0


@pytest.mark.parametrize(
    "wrong", [{"friction": -0.1}, {"stiffness": 0.0}, {"margin_cap": np.nan}, {"stiffness": -1}]
)
def test_parameters_out_of_range_are_refused(wrong):
    with pytest.raises(InvalidInputError, match=next(iter(wrong))):
        SettledContact(**wrong)


def test_robust_needs_a_sample():
    with pytest.raises(InvalidInputError, match="samples"):
        make_scorer("settled-robust", samples=0)
