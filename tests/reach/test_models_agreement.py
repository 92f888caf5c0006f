"""Compiled against reference: the same triangles, the linearization's error, and convergence."""

import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st

from reach import AreaContact, Grasp, GraspObject, ParallelJawGripper, Scene, transforms
from reach.kernels.min_norm import exit_of_ray
from reach.kernels.pads import pads_of
from reach.kernels.support import support
from reach.kernels.tree import mesh_tree
from reach.kernels.verdict import find_patch, make_workspace
from reach.limit_surface import DIRECTIONS, TriangleContacts, overshoot
from reach.models.reference import ReferenceAreaContact
from reach.patch import Patch
from reach.wrench import distance_to, friction_columns, grasp_map, linearized_margin, wrench_set

EXAMPLES = settings(max_examples=30, deadline=None, derandomize=True)
LENGTH = 0.03


def random_contacts(rng, friction=None):
    """Two contacts that roughly face each other, of a few triangles each."""
    contacts = []
    for side in (-1.0, 1.0):
        count = int(rng.integers(1, 6))
        frames = np.zeros((count, 4, 4))
        for i in range(count):
            z = np.array([-side, 0, 0]) + rng.normal(size=3) * 0.2
            z /= np.linalg.norm(z)
            x = np.cross(z, rng.normal(size=3))
            x /= np.linalg.norm(x)
            frames[i] = transforms.make_transform(
                np.column_stack([x, np.cross(z, x), z]),
                np.array([side * 0.015, 0, 0]) + rng.normal(size=3) * 0.006,
            )
        normal = rng.uniform(0.5, 8, count)
        mu = rng.uniform(0.2, 1) if friction is None else friction
        torsion = mu * normal * rng.uniform(0, 0.004, count) * rng.integers(0, 2, count)
        contacts.append(TriangleContacts(frames, normal, mu * normal, torsion))
    return contacts


def scaled_friction(contacts, factor):
    return [
        TriangleContacts(
            c.T_frame_triangle, c.normal_force, c.tangential * factor, c.torsion * factor
        )
        for c in contacts
    ]


def exact_margin(contacts, wrench, cap=50.0):
    margin, steps = exit_of_ray(*friction_columns(contacts, LENGTH), wrench, cap, 1e-4, 5000, 6)
    assert steps < 5000
    return margin


def random_wrench(rng):
    return np.concatenate([rng.normal(size=3), rng.normal(size=3) * 0.3])


@EXAMPLES
@given(st.integers(0, 2**32 - 1))
def test_on_identical_triangles_the_models_differ_by_the_linearization(seed):
    """The 18 planes enclose the ellipsoids, and reach beyond them by a known factor at most."""
    rng = np.random.default_rng(seed)
    contacts, wrench = random_contacts(rng), random_wrench(rng)
    linear = linearized_margin(wrench_set(contacts, LENGTH), wrench, 50.0)
    low = exact_margin(contacts, wrench)
    high = exact_margin(scaled_friction(contacts, overshoot()), wrench)
    assert low * (1 - 1e-3) - 2e-3 <= linear <= high * (1 + 1e-3) + 2e-3


@EXAMPLES
@given(st.integers(0, 2**32 - 1))
def test_quadratic_program_and_linear_program_agree(seed):
    rng = np.random.default_rng(seed)
    lam, wrench = wrench_set(random_contacts(rng), LENGTH), random_wrench(rng)
    margin = linearized_margin(lam, wrench, 50.0)
    if margin < 0.05 or margin > 49:
        return
    assert distance_to(lam, wrench * margin * 0.98) < 1e-4 * margin * np.linalg.norm(wrench)
    assert distance_to(lam, wrench * margin * 1.05) > 1e-4 * margin * np.linalg.norm(wrench)


@EXAMPLES
@given(st.integers(0, 2**32 - 1))
def test_support_function_bounds_and_attains_sampled_wrenches(seed):
    rng = np.random.default_rng(seed)
    contacts = random_contacts(rng)
    columns = friction_columns(contacts, LENGTH)
    d = rng.normal(size=6)
    d /= np.linalg.norm(d)
    farthest = np.zeros(6)
    value = support(*columns, d, farthest, np.zeros(6))
    assert farthest @ d == pytest.approx(value, abs=1e-7)  # attained
    best = -np.inf
    for _ in range(300):
        wrench = np.zeros(6)
        for contact in contacts:
            scale = rng.choice([0.0, 1.0, rng.uniform()])
            for i, G in enumerate(grasp_map(contact, LENGTH)):
                ball = rng.normal(size=3)
                ball /= np.linalg.norm(ball)
                limits = [contact.tangential[i]] * 2 + [contact.torsion[i]]
                fx, fy, tau = scale * ball * limits
                wrench += G @ [fx, fy, scale * contact.normal_force[i], tau]
        best = max(best, wrench @ d)
    assert best <= value + 1e-9  # never exceeded


def test_eighteen_points_and_their_overshoot():
    assert DIRECTIONS.shape == (18, 3)
    np.testing.assert_allclose(np.linalg.norm(DIRECTIONS, axis=1), 1)
    # The worst corner of the polytope; averaged over the sphere it overshoots by far less.
    d = np.random.default_rng(0).normal(size=(20000, 3))
    d /= np.linalg.norm(d, axis=1, keepdims=True)
    reach = 1 / (d @ DIRECTIONS.T).max(axis=1)
    assert reach.max() <= overshoot() + 1e-9 == pytest.approx(np.sqrt(1.5))
    assert np.mean(reach) < 1.09


@EXAMPLES
@given(st.integers(0, 2**32 - 1))
def test_exit_of_ray_does_not_depend_on_the_torque_scale(seed):
    rng = np.random.default_rng(seed)
    contacts, wrench = random_contacts(rng), random_wrench(rng)
    margins = []
    for length in (0.003, 0.03, 0.3):
        scaled = np.concatenate([wrench[:3], wrench[3:] * LENGTH / length])
        margin, _ = exit_of_ray(*friction_columns(contacts, length), scaled, 50.0, 1e-4, 20000, 6)
        margins.append(margin)
    np.testing.assert_allclose(margins, margins[1], rtol=5e-3, atol=5e-3)


def peg(subdivisions):
    """A bar with a hexagonal section: flat and tilted contacts."""
    mesh = trimesh.creation.cylinder(0.014, 0.05, sections=6)
    for _ in range(subdivisions):
        mesh = mesh.subdivide()
    return GraspObject("peg", mesh.vertices, mesh.faces, 0.4)


def across(turn, offset):
    """A grasp across the peg, some way along it and turned about it, fingers coming from its side."""
    return Grasp(
        transforms.make_transform(transforms.rotation_about((0, 0, 1), turn), (0, 0, offset))
        @ transforms.make_transform(transforms.rotation_about((1, 0, 0), np.pi / 2))
        @ transforms.make_transform(None, (0, 0, -0.160098))
    )


def triangle_by_triangle(scene, grasp):
    """Margin with the reference's patches and torsion bounds, all triangles, exact ellipsoids."""
    model = ReferenceAreaContact(triangles=None)
    T_object_com = transforms.make_transform(None, scene.object.com)
    T_com_gripper = transforms.inverse(T_object_com) @ grasp.T_object_gripper
    contacts = [
        model.contacts(
            model.patch(scene, grasp, jaw),
            grasp.force,
            T_com_gripper @ scene.gripper.T_gripper_pad(jaw),
        )
        for jaw in (0, 1)
    ]
    return exact_margin(contacts, np.array([0, 0, 9.81 * scene.object.mass, 0, 0, 0]))


def triangles_by_clipping(scene, grasp, model):
    """Every triangle that the compiled clipping finds, each with the reference's limit surface."""
    pads, depth = pads_of(scene.gripper), min(model.compliance * grasp.force, 5.3e-3)
    T_com_gripper = np.array(grasp.T_object_gripper)
    T_com_gripper[:3, 3] -= scene.object.com
    contacts = []
    for jaw in (0, 1):
        T_pad = pads.T_gripper_pad[jaw]
        count, high, space = find_patch(
            mesh_tree(scene.object),
            pads,
            jaw,
            grasp.T_object_gripper @ T_pad,
            depth,
            make_workspace(1),
        )
        patch = Patch(space.triangles[:count], space.normals[:count], high - depth, depth)
        contacts.append(model.contacts(patch, grasp.force, T_com_gripper @ T_pad))
    return contacts


@EXAMPLES
@given(st.floats(-0.4, 0.4), st.floats(-0.015, 0.015), st.integers(0, 1))
def test_without_aggregation_compiled_and_reference_differ_by_the_linearization(
    turn, offset, level
):
    """On the very triangles that clipping finds: exact ellipsoids against 18 planes each."""
    scene, grasp = scene_of(level, np.eye(4)), across(turn, offset)
    contacts = triangles_by_clipping(scene, grasp, ReferenceAreaContact(triangles=None))
    weight = np.array([0, 0, 9.81 * scene.object.mass, 0, 0, 0])
    linear = linearized_margin(wrench_set(contacts, LENGTH), weight, 50.0)
    low = exact_margin(contacts, weight)
    high = exact_margin(scaled_friction(contacts, overshoot()), weight)
    assert 0 < low < 50
    assert low * (1 - 1e-3) <= linear <= high * (1 + 1e-3)


def scene_of(level, pose):
    return Scene(peg(level), ParallelJawGripper.yumi(), pose)


@pytest.mark.parametrize(("turn", "offset"), [(0.0, 0.012), (0.05, 0.008), (0.3, 0.010)])
def test_reference_converges_to_the_compiled_model_under_subdivision(turn, offset):
    """The torsion bound vanishes with the triangles' size, and what remains is exact friction."""
    grasp = across(turn, offset)
    target = AreaContact().evaluate(scene_of(0, np.eye(4)), grasp).margin
    coarse, fine = (triangle_by_triangle(scene_of(level, np.eye(4)), grasp) for level in (0, 3))
    assert 1 < target < 50
    assert coarse < target * 1.005  # a lower bound
    assert fine == pytest.approx(target, rel=3e-3)
    if turn == 0.0:
        assert coarse < 0.95 * target


def test_ten_largest_triangles_depend_on_the_mesh_and_the_compiled_model_does_not():
    lying = transforms.make_transform(transforms.rotation_about((1, 0, 0), -np.pi / 2))
    grasp = across(0.0, 0.012)
    margins, reference = [], []
    for level in (0, 3):
        scene = scene_of(level, lying)
        margins.append(AreaContact().evaluate(scene, grasp).margin)
        reference.append(ReferenceAreaContact(triangles=10).evaluate(scene, grasp).margin)
    assert margins[1] == pytest.approx(margins[0], rel=1e-3)
    assert reference[1] < 0.7 * reference[0]
