"""Cases with a known answer: a flat square, a sphere, the edge and the corner of a cube."""

import numpy as np
import pytest
import trimesh

from reach import (
    AreaContact,
    EllipseContact,
    Grasp,
    GraspObject,
    Pad,
    ParallelJawGripper,
    PointContact,
    Scene,
    transforms,
)
from reach.contact import Reason
from reach.gripper import Jaw
from reach.kernels.support import support
from reach.limit_surface import TriangleContacts
from reach.models.reference import ReferenceAreaContact
from reach.patch import Patch
from reach.wrench import friction_columns

EXACT_TORSION = (np.sqrt(2) + np.log(1 + np.sqrt(2))) / 6
"""Mean distance from the center of a unit square, 0.38260."""
GRAVITY = 9.81


def cube(edge=0.03, mass=0.05, subdivisions=0):
    mesh = trimesh.creation.box((edge, edge, edge))
    for _ in range(subdivisions):
        mesh = mesh.subdivide()
    return GraspObject("cube", mesh.vertices, mesh.faces, mass)


def at(x=0.0, y=0.0, z=0.0, rotation=None):
    """A grasp whose pads' origins face each other at a point of the object."""
    turn = transforms.make_transform(rotation, (x, y, z))
    return Grasp(turn @ transforms.make_transform(None, (0, 0, -0.160098)))


def scene_of(part, gripper=None):
    return Scene(part, gripper or ParallelJawGripper.yumi(), np.eye(4))


def square_gripper(side=0.01):
    """Two square pads that press flat on whatever is between them."""
    h = side / 2
    pad = Pad(np.array([(-h, -h), (h, -h), (h, h), (-h, h)]))
    yumi = ParallelJawGripper.yumi()
    jaws = []
    for jaw in yumi.jaws:
        T = np.array(jaw.T_gripper_pad_open)
        T[1, 3] = 0.0
        jaws.append(Jaw(pad, T))
    return ParallelJawGripper("square", tuple(jaws), 0.025, 20.0, 0.02)


def test_flat_square_carries_twice_mu_times_the_closing_force():
    grasp = at()
    verdict = AreaContact(friction=0.5, margin_cap=100).evaluate(
        scene_of(cube(mass=0.1), square_gripper()), grasp
    )
    assert verdict.margin == pytest.approx(2 * 0.5 * grasp.force / (0.1 * GRAVITY), rel=2e-3)
    assert [patch.area for patch in verdict.patches] == pytest.approx([1e-4, 1e-4])


def torsion_of_square(triangles):
    """Torsional limit over mu f_C s of a flat unit square cut into given triangles."""
    triangles = np.asarray(triangles, dtype=float)
    normals = np.tile([0.0, 0.0, 1.0], (len(triangles), 1))
    patch = Patch(triangles, normals, contact_depth=0.0, deformation=1.0)
    contacts = ReferenceAreaContact(friction=1.0, triangles=None).contacts(patch, 1.0, np.eye(4))
    normal, columns, starts = friction_columns([contacts], 1.0)
    d = np.array([0, 0, 0, 0, 0, 1.0])
    return support(normal, columns, starts, d, np.zeros(6), np.zeros(6))


def square_triangles(levels):
    h = 0.5
    mesh = trimesh.Trimesh([(-h, -h, 0), (h, -h, 0), (h, h, 0), (-h, h, 0)], [(0, 1, 2), (0, 2, 3)])
    for _ in range(levels):
        mesh = mesh.subdivide()
    return mesh.triangles


def test_the_papers_bound_on_a_square_grows_with_subdivision_to_the_exact_torsion():
    torsions = [torsion_of_square(square_triangles(level)) for level in range(6)]
    assert torsions[0] == pytest.approx(0.236, abs=1e-3)
    assert torsions[1] == pytest.approx(0.363, abs=1e-3)
    assert np.all(np.diff(torsions) > 0)
    assert torsions[-1] == pytest.approx(EXACT_TORSION, rel=1e-3)


def test_compiled_torsion_of_a_square_is_within_one_percent_of_exact():
    """Both pads resist turning about the closing axis: 2 mu f_C s 0.3826 of torque."""
    mu, force, side, mass = 0.5, 20.0, 0.01, 0.05
    part = cube(mass=mass)
    scene = scene_of(part, square_gripper(side))
    batch = AreaContact(friction=mu, margin_cap=1000).evaluate_batch(
        scene,
        np.broadcast_to(at().T_object_gripper, (41, 4, 4)),
        force=force,
        com=np.column_stack([np.zeros(41), np.linspace(0, 0.2, 41), np.zeros(41)]),
    )
    # Gravity on an arm y: force m g and torque m g y share the friction of the two squares.
    arms = np.linspace(0, 0.2, 41)[20:]
    torque_limit = 2 * mu * force * side * EXACT_TORSION
    held = batch.margin[20:] * mass * GRAVITY * arms
    # Far out the force is small beside the torque, and the limit is nearly pure torsion.
    share = batch.margin[-1] * mass * GRAVITY / (2 * mu * force)
    assert held[-1] == pytest.approx(torque_limit * np.sqrt(1 - share**2), rel=0.01)
    assert np.all(held <= torque_limit * 1.01)


def test_sphere_between_pads_holds_like_coulomb():
    mesh = trimesh.creation.icosphere(4, 0.015)
    part = GraspObject("ball", mesh.vertices, mesh.faces, 0.05)
    grasp = at()
    verdict = AreaContact(friction=0.4, margin_cap=100).evaluate(scene_of(part), grasp)
    coulomb = 2 * 0.4 * grasp.force / (0.05 * GRAVITY)
    assert verdict.resists
    # The cap's slope against gravity adds to friction, never takes from it.
    assert coulomb * 0.95 < verdict.margin < coulomb * 1.2
    for patch in verdict.patches:
        cap_area = 2 * np.pi * 0.015 * 4e-3
        assert patch.area == pytest.approx(cap_area, rel=0.05)
        assert abs(patch.force_object[0]) < grasp.force
        assert np.linalg.norm(patch.force_object[1:]) < 0.02 * grasp.force


def diagonal(axis):
    """Rotation that lays the gripper's closing axis x along a direction of the cube."""
    x = np.asarray(axis, float) / np.linalg.norm(axis)
    z = np.cross(x, (1.0, -1.0, 0.0))
    z /= np.linalg.norm(z)
    return np.column_stack([x, np.cross(z, x), z])


def test_corner_of_a_cube_defeats_the_point_model_and_not_reach():
    """Fig. 1 of the paper: pads close on opposite corners of a cube."""
    part = cube(edge=0.025)
    scene = Scene(part, ParallelJawGripper.yumi(), np.eye(4))
    grasp = at(rotation=diagonal((1, 1, 1)))
    point = PointContact(friction=0.5).evaluate(scene, grasp)
    reach = AreaContact(friction=0.5).evaluate(scene, grasp)
    assert not point.resists and point.reason in (Reason.SLIPS, Reason.TORQUE)
    assert reach.resists and reach.margin > 5


def test_edge_of_a_cube_defeats_the_point_model_and_not_reach():
    part = cube(edge=0.03)
    scene = Scene(part, ParallelJawGripper.yumi(), np.eye(4))
    # The closing axis runs through two opposite edges, off by a tenth of a millimeter.
    turn = transforms.rotation_about((0, 0, 1), np.pi / 4)
    grasp = at(x=1e-4, y=-1e-4, rotation=turn)
    assert not PointContact(friction=0.5).evaluate(scene, grasp).resists
    assert AreaContact(friction=0.5).evaluate(scene, grasp).resists


def test_each_failure_has_its_own_reason():
    scene = scene_of(cube(mass=0.05))
    model = AreaContact(friction=0.4)
    beside = model.evaluate(scene, at(y=0.1))
    assert beside.reason is Reason.NO_CONTACT and beside.missing_jaws == (0, 1)
    heavy = model.evaluate(scene_of(cube(mass=5.0)), at())
    assert heavy.reason is Reason.SLIPS and 0 < heavy.margin < 1
    assert "slips" in heavy.explanation
    long = trimesh.creation.box((0.02, 0.25, 0.02))
    bar = GraspObject("bar", long.vertices, long.faces, 0.25)
    held_at_end = model.evaluate(scene_of(bar), at(y=0.115))
    assert held_at_end.reason is Reason.TORQUE and held_at_end.missing_jaws == ()


def test_one_jaw_without_contact_is_named():
    """A wedge that only the jaw from one side can see."""
    mesh = trimesh.creation.box((0.02, 0.03, 0.03))
    part = GraspObject("plate", mesh.vertices, mesh.faces, 0.01)
    yumi = ParallelJawGripper.yumi()
    far = np.array(yumi.jaws[1].T_gripper_pad_open)
    far[1, 3] += 0.1
    gripper = ParallelJawGripper(
        "offset", (yumi.jaws[0], Jaw(yumi.jaws[1].pad, far)), 0.025, 20.0, 0.02
    )
    for model in (AreaContact(), EllipseContact(), PointContact(), ReferenceAreaContact()):
        verdict = model.evaluate(Scene(part, gripper, np.eye(4)), at())
        assert verdict.reason is Reason.NO_CONTACT
        assert verdict.missing_jaws == (1,)
        assert verdict.explanation == "no contact on jaw 1"


def test_part_off_the_middle_is_found():
    """Jaws start open: a part 9 mm off along the closing axis is met by both."""
    for offset in (-0.009, 0.009):
        verdict = AreaContact().evaluate(scene_of(cube()), at(x=offset))
        assert verdict.resists
        assert len(verdict.patches) == 2


def test_three_jaws():
    mesh = trimesh.creation.cylinder(0.015, 0.03, sections=48)
    part = GraspObject("rod", mesh.vertices, mesh.faces, 0.05)
    pad = ParallelJawGripper.yumi().jaws[0].pad
    jaws = []
    for turn in (0.0, 2 * np.pi / 3, 4 * np.pi / 3):
        inward = np.array([np.cos(turn), np.sin(turn), 0.0])
        x = np.array([0.0, 0.0, 1.0])
        T = transforms.make_transform(
            np.column_stack([x, np.cross(inward, x), inward]), -0.025 * inward
        )
        jaws.append(Jaw(pad, T))
    gripper = ParallelJawGripper("three", tuple(jaws), 0.025, 20.0, 0.02)
    scene, grasp = Scene(part, gripper, np.eye(4)), Grasp(np.eye(4))
    verdict = AreaContact(friction=0.5, margin_cap=100).evaluate(scene, grasp)
    reference = ReferenceAreaContact(friction=0.5, triangles=None, margin_cap=100).evaluate(
        scene, grasp
    )
    assert len(verdict.patches) == 3
    assert verdict.margin == pytest.approx(3 * 0.5 * 20 / (0.05 * GRAVITY), rel=0.05)
    assert reference.resists and reference.margin == pytest.approx(verdict.margin, rel=0.1)


def test_soft_point_contact_closed_form():
    """Two antipodal points: force 2 mu f, torsion 2 gamma f about the closing axis."""
    mu, gamma, mass = 0.5, 0.004, 0.05
    scene = scene_of(cube(mass=mass))
    model = PointContact(friction=mu, torsion=gamma, margin_cap=100)
    assert model.evaluate(scene, at()).margin == pytest.approx(
        2 * mu * 20 / (mass * GRAVITY), rel=2e-3
    )
    verdict = model.evaluate(scene, at(y=0.012))
    assert verdict.margin == pytest.approx(2 * gamma * 20 / (mass * GRAVITY * 0.012), rel=2e-3)


def test_ellipse_closed_form_on_a_square():
    """A square's ellipse has semi-axes s / sqrt 3; force and torsion share one limit surface."""
    mu, mass, side, arm = 0.5, 0.05, 0.01, 0.009
    scene = scene_of(cube(mass=mass), square_gripper(side))
    margin = EllipseContact(friction=mu, margin_cap=100).evaluate(scene, at(y=arm)).margin
    force, torque = 2 * mu * 20, 2 * mu * 20 * 3 * np.pi / 16 * side / np.sqrt(3)
    weight = mass * GRAVITY
    assert margin == pytest.approx(1 / np.hypot(weight / force, weight * arm / torque), rel=3e-3)


def test_triangle_contacts_are_a_plain_value():
    contacts = TriangleContacts(np.eye(4)[None], np.ones(1), np.ones(1), np.zeros(1))
    assert len(contacts) == 1


def test_a_pad_that_touches_beside_its_center_ray_has_a_point_contact():
    """Both rays pass 5 mm above the cube, which the lower part of the pads holds."""
    part = cube(mass=0.003)
    above = at(z=0.02)
    assert PointContact(friction=0.5).evaluate(scene_of(part), above).resists
    # Off to the side the contacts are on the cube's edge, and gravity turns the part about them.
    sideways = at(y=0.024)
    with_torsion = PointContact(friction=0.5, torsion=5e-3, margin_cap=1e4)
    arm = 0.015  # from the cube's side edge to its center
    margin = with_torsion.evaluate(scene_of(part), sideways).margin
    limit = 2 * 20.0 * 5e-3 / (0.003 * GRAVITY * arm)
    assert margin == pytest.approx(limit, rel=0.02)
    beyond = PointContact(friction=0.5).evaluate(scene_of(part), at(z=0.04))
    assert beyond.reason is Reason.NO_CONTACT


def test_a_point_contact_does_not_sit_on_a_wall_that_faces_the_pad_by_a_hair():
    """Tilted by a degree, the cube's top faces the jaws a little and lies nearer to their rays."""
    part = cube(mass=0.003)
    for degrees in (-1.0, 1.0):
        turn = transforms.rotation_about((0, 1, 0), np.radians(degrees))
        verdict = PointContact(friction=0.5).evaluate(scene_of(part), at(z=0.02, rotation=turn))
        assert verdict.resists


def test_point_and_area_contacts_miss_the_same_jaws():
    rng = np.random.default_rng(4)
    part = cube()
    T = np.array([at(*rng.uniform(-0.03, 0.03, 3)).T_object_gripper for _ in range(200)])
    point = PointContact().evaluate_batch(scene_of(part), T)
    area = AreaContact().evaluate_batch(scene_of(part), T)
    np.testing.assert_array_equal(point.missing, area.missing)
    assert 20 < np.count_nonzero(point.missing) < 180
