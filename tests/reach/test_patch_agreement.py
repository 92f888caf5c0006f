"""The compiled patch and pressure agree with solid geometry and with numerical integration."""

import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st

from reach import Grasp, GraspObject, Pad, ParallelJawGripper, Scene, transforms
from reach.gripper import Jaw
from reach.models.area import AreaContact
from reach.models.reference import ReferenceAreaContact
from reach.patch import find_patch
from reach.pressure import (
    moment_integrals,
    normal_integrals,
    shape_of_pressure,
    stiffness,
    triangle_frames,
)

EXAMPLES = settings(max_examples=40, deadline=None, derandomize=True)


def random_part(rng):
    kind = rng.integers(4)
    if kind == 0:
        mesh = trimesh.creation.box(rng.uniform(0.01, 0.045, 3))
    elif kind == 1:
        mesh = trimesh.convex.convex_hull(rng.uniform(-0.02, 0.02, (20, 3)))
    elif kind == 2:
        mesh = trimesh.creation.icosphere(2, 0.018)
        mesh.vertices *= 1 + 0.15 * np.sin(300 * mesh.vertices[:, [1, 2, 0]])  # dents
    else:
        mesh = trimesh.creation.annulus(0.008, 0.018, rng.uniform(0.01, 0.03), sections=24)
    mass = rng.uniform(0.002, 0.5)
    return GraspObject("random", mesh.vertices, mesh.faces, mass)


def random_gripper(rng):
    """YuMi's jaws with any convex pads."""
    yumi = ParallelJawGripper.yumi()
    jaws = []
    for jaw in yumi.jaws:
        angles = np.sort(rng.uniform(0, 2 * np.pi, 4)) + np.linspace(0, 1e-3, 4)
        angles = np.concatenate([angles, [0, 2.1, 4.2]])
        circle = np.column_stack([np.cos(np.sort(angles)), np.sin(np.sort(angles))])
        pad = Pad(circle * rng.uniform(0.006, 0.016, 2), max_deformation=rng.uniform(2e-3, 6e-3))
        jaws.append(Jaw(pad, jaw.T_gripper_pad_open))
    return ParallelJawGripper("random", tuple(jaws), 0.025, 20.0, 0.02)


def random_case(seed):
    rng = np.random.default_rng(seed)
    part = random_part(rng)
    turn = transforms.exp(np.concatenate([rng.normal(size=3) * 2, np.zeros(3)]))
    T = transforms.make_transform(turn[:3, :3], part.com) @ transforms.make_transform(
        None, rng.uniform(-0.006, 0.006, 3) - (0, 0, 0.160)
    )
    grasp = Grasp(T, force=rng.uniform(2, 20))
    parameters = {
        "friction": rng.uniform(0.1, 1.2),
        "compliance": rng.uniform(5e-5, 5e-4),
        "saturate": bool(rng.integers(2)),
    }
    return Scene(part, random_gripper(rng), np.eye(4)), grasp, parameters


@EXAMPLES
@given(st.integers(0, 2**32 - 1))
def test_compiled_patch_is_the_solid_intersection(seed):
    scene, grasp, parameters = random_case(seed)
    compiled = AreaContact(**parameters).evaluate(scene, grasp)
    reference = ReferenceAreaContact(**parameters, triangles=10).evaluate(scene, grasp)
    assert compiled.missing_jaws == reference.missing_jaws
    assert len(compiled.patches) == len(reference.patches)
    for ours, theirs in zip(compiled.patches, reference.patches, strict=True):
        assert ours.jaw == theirs.jaw
        assert ours.area == pytest.approx(theirs.area, rel=1e-4, abs=1e-9)
        np.testing.assert_allclose(ours.center_object, theirs.center_object, atol=1e-7)
        np.testing.assert_allclose(ours.force_object, theirs.force_object, atol=1e-3)
        np.testing.assert_allclose(ours.torque_object, theirs.torque_object, atol=1e-5)
        np.testing.assert_allclose(ours.T_object_pad, theirs.T_object_pad, atol=1e-9)


@EXAMPLES
@given(st.integers(0, 2**32 - 1))
def test_pressure_carries_the_closing_force_and_vanishes_where_the_pad_ends(seed):
    scene, grasp, parameters = random_case(seed)
    for patch in AreaContact(**parameters).evaluate(scene, grasp).patches:
        triangles, p = patch.triangles_object, patch.pressures
        edges = triangles[:, 1:] - triangles[:, :1]
        areas = 0.5 * np.linalg.norm(np.cross(edges[:, 0], edges[:, 1]), axis=1)
        assert areas.sum() == pytest.approx(patch.area)
        assert (areas * p.mean(axis=1)).sum() == pytest.approx(grasp.force)  # f_C = sum of f_z
        assert p.min() >= -1e-6 * p.max()
        # p = k delta (n . a), evaluated afresh at every corner.
        pad = scene.gripper.jaws[patch.jaw].pad
        a = patch.T_object_pad[:3, 2]
        depth = (triangles - patch.T_object_pad[:3, 3]) @ a
        deformation = parameters["compliance"] * grasp.force
        if parameters["saturate"]:
            deformation = min(deformation, pad.max_deformation)
        normals = np.cross(edges[:, 1], edges[:, 0])
        along = np.abs(normals @ a) / np.maximum(np.linalg.norm(normals, axis=1), 1e-30)
        expected = (deformation - depth) * along[:, None]
        large = areas > 1e-10  # the normal of a sliver is not to be had from its corners
        k = grasp.force / (areas * expected.mean(axis=1)).sum()
        np.testing.assert_allclose(p[large], k * expected[large], atol=2e-5 * p.max())


@EXAMPLES
@given(st.integers(0, 2**32 - 1))
def test_closed_integrals_agree_with_quadrature(seed):
    scene, grasp, parameters = random_case(seed)
    pad = scene.gripper.jaws[0].pad
    T_object_pad = grasp.T_object_gripper @ scene.gripper.T_gripper_pad(0)
    patch = find_patch(
        scene.object, pad, T_object_pad, low=-2e-3, high=0.05, deformation=parameters["compliance"]
    )
    if patch is None:
        return
    frames = triangle_frames(patch)
    # Midpoints of a triangle's edges integrate polynomials of degree two exactly.
    middles = 0.5 * (patch.triangles_pad + np.roll(patch.triangles_pad, -1, axis=1))
    q = shape_of_pressure(patch, middles, patch.normals_pad[:, None])
    arms = middles - frames.T_pad_triangle[:, None, :3, 3]
    x = np.einsum("mij,mj->mi", arms, frames.T_pad_triangle[:, :3, 0])
    y = np.einsum("mij,mj->mi", arms, frames.T_pad_triangle[:, :3, 1])
    third = frames.areas / 3
    scale = float(third.sum() * q.max())
    np.testing.assert_allclose(normal_integrals(frames), third * q.sum(axis=1), atol=1e-9 * scale)
    moment_x, moment_y = moment_integrals(frames)
    np.testing.assert_allclose(moment_x, third * (x * q).sum(axis=1), atol=1e-12 * scale)
    np.testing.assert_allclose(moment_y, third * (y * q).sum(axis=1), atol=1e-12 * scale)
    a, b, d = frames.coefficients.T
    np.testing.assert_allclose(a[:, None] * x + b[:, None] * y + d[:, None], q, atol=1e-12)
    assert stiffness(frames, 7.0) * normal_integrals(frames).sum() == pytest.approx(7.0)


def test_surface_cut_open_by_the_search_plane_is_no_contact_surface():
    """A part that the open pad already stands in gives no contact on the cut, in both models."""
    mesh = trimesh.creation.box((0.08, 0.03, 0.03))
    part = GraspObject("wide", mesh.vertices, mesh.faces, 0.01)
    scene = Scene(part, ParallelJawGripper.yumi(), np.eye(4))
    grasp = Grasp(transforms.make_transform(None, (0, 0, -0.160)))
    for model in (AreaContact(), ReferenceAreaContact()):
        verdict = model.evaluate(scene, grasp)
        assert verdict.missing_jaws == (0, 1)
        assert "no contact on jaws 0 and 1" in verdict.explanation
