"""What must not change a verdict, and what must change it in one direction only."""

from dataclasses import replace

import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st

from reach import (
    AreaContact,
    EllipseContact,
    Grasp,
    GraspObject,
    ParallelJawGripper,
    PointContact,
    Scene,
    transforms,
)
from reach.models import base

EXAMPLES = settings(max_examples=25, deadline=None, derandomize=True)
YUMI = ParallelJawGripper.yumi()
MODELS = [AreaContact(), EllipseContact(), PointContact(torsion=0.006)]


def random_mesh(rng):
    kind = rng.integers(3)
    if kind == 0:
        return trimesh.creation.box(rng.uniform(0.015, 0.04, 3))
    if kind == 1:
        return trimesh.convex.convex_hull(rng.uniform(-0.02, 0.02, (15, 3)))
    mesh = trimesh.creation.icosphere(3, 0.018)
    mesh.vertices *= 1 + 0.1 * np.sin(250 * mesh.vertices[:, [1, 2, 0]])
    return mesh


def random_case(seed):
    rng = np.random.default_rng(seed)
    mesh = random_mesh(rng)
    part = GraspObject("part", mesh.vertices, mesh.faces, rng.uniform(0.1, 1.0))
    turn = transforms.exp(np.concatenate([rng.normal(size=3) * 2, np.zeros(3)]))[:3, :3]
    T = transforms.make_transform(turn, part.com) @ transforms.make_transform(
        None, rng.uniform(-0.005, 0.005, 3) - (0, 0, 0.160)
    )
    pose = transforms.exp(rng.normal(size=6))
    return Scene(part, YUMI, pose), Grasp(T), rng


def assert_same(a, b, rtol):
    assert a.reason == b.reason or min(abs(a.margin - 1), abs(b.margin - 1)) < 2 * rtol
    assert a.missing_jaws == b.missing_jaws
    assert a.margin == pytest.approx(b.margin, rel=rtol, abs=2e-3)


@EXAMPLES
@given(st.integers(0, 2**32 - 1))
def test_subdivision_changes_nothing(seed):
    scene, grasp, _ = random_case(seed)
    mesh = scene.object.mesh
    for _ in range(2):
        mesh = mesh.subdivide()
    fine = replace(scene, object=GraspObject("fine", mesh.vertices, mesh.faces, scene.object.mass))
    for model in MODELS:
        assert_same(model.evaluate(fine, grasp), model.evaluate(scene, grasp), 0.02)


@EXAMPLES
@given(st.integers(0, 2**32 - 1))
def test_rigid_motion_of_the_objects_frame_changes_nothing(seed):
    scene, grasp, rng = random_case(seed)
    T_new_old = transforms.exp(rng.normal(size=6))
    part = scene.object
    moved = Scene(
        GraspObject("moved", transforms.apply(T_new_old, part.vertices), part.faces, part.mass),
        scene.gripper,
        scene.T_world_object @ transforms.inverse(T_new_old),
    )
    for model in MODELS:
        again = model.evaluate(moved, Grasp(T_new_old @ grasp.T_object_gripper))
        assert_same(again, model.evaluate(scene, grasp), 5e-3)


@EXAMPLES
@given(st.integers(0, 2**32 - 1))
def test_order_of_vertices_and_faces_changes_nothing(seed):
    scene, grasp, rng = random_case(seed)
    part = scene.object
    vertices = rng.permutation(len(part.vertices))
    where = np.argsort(vertices)
    faces = np.roll(where[part.faces][rng.permutation(len(part.faces))], 1, axis=1)
    shuffled = GraspObject("shuffled", part.vertices[vertices], faces, part.mass)
    for model in MODELS:
        again = model.evaluate(replace(scene, object=shuffled), grasp)
        assert_same(again, model.evaluate(scene, grasp), 5e-3)


@EXAMPLES
@given(st.integers(0, 2**32 - 1))
def test_units_of_torque_change_nothing(seed):
    scene, grasp, _ = random_case(seed)
    with pytest.MonkeyPatch.context() as patch:
        margins = []
        for length in (0.01, 0.03, 0.1):
            patch.setattr("reach.models.wrench_set_model.TORQUE_LENGTH", length)
            margins.append(AreaContact().evaluate(scene, grasp).margin)
    np.testing.assert_allclose(margins, margins[1], rtol=5e-3, atol=2e-3)


@EXAMPLES
@given(st.integers(0, 2**32 - 1))
def test_more_friction_never_holds_less(seed):
    scene, grasp, _ = random_case(seed)
    frictions = np.linspace(0.0, 1.5, 12)
    T = np.broadcast_to(grasp.T_object_gripper, (12, 4, 4))
    for model in MODELS:
        margins = model.evaluate_batch(scene, T, friction=frictions).margin
        assert np.all(np.diff(margins) >= -2e-3 * margins[:-1] - 1e-3)


@EXAMPLES
@given(st.integers(0, 2**32 - 1))
def test_margin_is_the_mass_that_can_be_held(seed):
    """A part of `margin` times the mass is just held, and margins scale inversely with mass."""
    scene, grasp, _ = random_case(seed)
    margin = AreaContact(margin_cap=1e4).evaluate(scene, grasp).margin
    if not 0.1 < margin < 1e3:
        return
    T, mass = grasp.T_object_gripper[None], scene.object.mass
    just = AreaContact().evaluate_batch(scene, T, mass=mass * margin * 0.99)
    over = AreaContact().evaluate_batch(scene, T, mass=mass * margin * 1.01)
    assert just.resists[0] and not over.resists[0]


@pytest.mark.parametrize("model", MODELS, ids=lambda model: model.name)
def test_batch_equals_single_grasps_whatever_the_chunks_and_cores(model, monkeypatch):
    scene, grasp, rng = random_case(7)
    T = grasp.T_object_gripper @ transforms.exp(rng.normal(size=(60, 6)) * 0.004)
    single = [model.evaluate(scene, Grasp(pose)) for pose in T]
    seen = []
    whole = model.evaluate_batch(scene, T)
    monkeypatch.setattr(base, "CHUNK", 7)
    parts = model.evaluate_batch(scene, T, progress=seen.append)
    np.testing.assert_array_equal(whole.margin, parts.margin)  # bit for bit
    np.testing.assert_array_equal(whole.margin, [verdict.margin for verdict in single])
    np.testing.assert_array_equal(whole.resists, [verdict.resists for verdict in single])
    assert whole.reasons() == tuple(verdict.reason for verdict in single)
    assert seen == [*range(7, 60, 7), 60]
    assert sum(whole.counts().values()) == len(whole) == 60


def test_batch_takes_force_friction_mass_and_center_per_grasp():
    scene, grasp, _ = random_case(3)
    T = np.broadcast_to(grasp.T_object_gripper, (3, 4, 4))
    force, friction, mass = (
        np.array([5.0, 10, 20]),
        np.array([0.3, 0.5, 0.7]),
        np.array([0.1, 0.2, 1]),
    )
    com = scene.object.com + np.array([[0, 0, 0], [0.002, 0, 0], [0, 0.003, 0.001]])
    batch = AreaContact().evaluate_batch(
        scene, T, force=force, friction=friction, mass=mass, com=com
    )
    for i in range(3):
        part = replace(scene.object, mass=mass[i], center_of_mass=com[i])
        verdict = AreaContact(friction=friction[i]).evaluate(
            replace(scene, object=part), replace(grasp, force=force[i])
        )
        assert batch.margin[i] == pytest.approx(verdict.margin, rel=1e-9)
