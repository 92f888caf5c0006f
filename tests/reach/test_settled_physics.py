"""The settled model on cases with a known answer: what aligns, what jams, what is squeezed out."""

import numpy as np
import pytest
import trimesh

from reach import Grasp, GraspObject, ParallelJawGripper, Scene, SettledContact, transforms
from reach.contact import Reason
from reach.gripper import Jaw
from reach.kernels.pads import pads_of
from reach.kernels.settle_motion import motions_on_table
from reach.kernels.settle_push import gyration_about, push, pushed_twist, spread_about
from reach.kernels.settle_room import Hand, make_room
from reach.kernels.tree import mesh_tree
from reach.models.settled import FOUNDATION_STIFFNESS
from reach.models.settled_verdict import Fate
from reach.raycast import RaycastScene
from reach.world.parameters import WorldParameters

YUMI = ParallelJawGripper.yumi()
FORCE = 20.0


def part_of(mesh, mass=0.03, name="part"):
    return GraspObject(name, mesh.vertices, mesh.faces, mass)


def cube(edge=0.03, mass=0.03):
    return part_of(trimesh.creation.box((edge, edge, edge)), mass, "cube")


def wedge(half_angle, length=0.04, width=0.02):
    """A prism whose two pressed faces meet the closing axis x at a half angle; thick at low y."""
    thick = width / 2 + length / 2 * np.tan(half_angle)
    thin = width / 2 - length / 2 * np.tan(half_angle)
    h, y = 0.015, length / 2
    corners = [
        (sx * w, sy, z) for sx in (-1, 1) for w, sy in ((thick, -y), (thin, y)) for z in (-h, h)
    ]
    return part_of(trimesh.convex.convex_hull(corners), name="wedge")


def cylinder(radius=0.012):
    return part_of(trimesh.creation.cylinder(radius, 0.04, sections=256), name="cylinder")


def ball(radius=0.015):
    return part_of(trimesh.creation.icosphere(4, radius), name="ball")


def from_above(yaw=0.0, x=0.0, y=0.0, z=0.0):
    """A grasp straight down, its pads' origins about a point of the part, turned by yaw."""
    down = transforms.rotation_about((0, 0, 1), yaw) @ np.diag([1.0, -1.0, -1.0])
    return Grasp(transforms.make_transform(down, (x, y, z + 0.160098)), force=FORCE)


def judged(part, grasp, **parameters):
    return SettledContact(**parameters).evaluate(Scene(part, YUMI, np.eye(4)), grasp)


def test_pads_are_those_of_the_pin_world():
    assert WorldParameters().foundation_modulus == pytest.approx(FOUNDATION_STIFFNESS)


def test_a_flat_face_is_pressed_uniformly_by_the_closing_force():
    verdict = judged(cube(), from_above())
    for patch in verdict.patches:
        assert np.ptp(patch.pressures) < 1e-6 * FORCE / patch.area
        assert patch.pressures.mean() * patch.area == pytest.approx(FORCE)
    assert verdict.settlement.translation == verdict.settlement.yaw == 0.0


def test_low_friction_lets_a_turned_cube_align():
    verdict = judged(cube(), from_above(np.radians(20)), friction=0.3)
    assert verdict.resists and verdict.settlement.fate is Fate.HELD
    assert 17 < np.degrees(verdict.settlement.yaw) < 21
    assert "settles by" in verdict.explanation


@pytest.mark.parametrize(("friction", "turned"), [(0.3, True), (0.5, False), (0.8, False)])
def test_friction_decides_whether_a_turned_cube_aligns_or_jams(friction, turned):
    """Two opposite edges at 45 - 20 degrees to the closing axis jam, as two points, above a friction
    of tan 25 deg = .47; soft pads press beside the edges as well, and jam above .41."""
    verdict = judged(cube(), from_above(np.radians(20)), friction=friction)
    assert verdict.resists
    assert verdict.settlement.preload_share < 1
    if turned:
        assert np.degrees(verdict.settlement.yaw) > 13
    else:
        assert np.degrees(verdict.settlement.yaw) < 2
        assert "rests as it lay" in verdict.explanation


def test_a_cube_at_45_degrees_is_held_on_its_edges():
    verdict = judged(cube(), from_above(np.radians(45)), friction=0.3)
    assert verdict.resists
    assert verdict.settlement.yaw == 0.0
    for patch in verdict.patches:
        assert patch.area < 0.6 * YUMI.jaws[0].pad.area


@pytest.mark.parametrize("friction", [0.2, 0.4])
def test_a_wedge_is_squeezed_out_beyond_the_friction_angle_and_not_below(friction):
    limit = np.arctan(friction)
    held = judged(wedge(limit - np.radians(1.5)), from_above(), friction=friction)
    lost = judged(wedge(limit + np.radians(1.5)), from_above(), friction=friction)
    assert held.resists and held.settlement.translation < 1e-3
    assert lost.settlement.fate is Fate.SQUEEZED_OUT and not lost.resists
    assert lost.reason is Reason.SLIPS and "squeezed out" in lost.explanation
    moved = lost.settlement.path[-1][:3, 3]
    assert moved[1] < -0.01 and abs(moved[0]) < 1e-3  # the thick end leaves, along the table


def test_a_wedges_preload_is_that_of_two_inclined_planes():
    angle = np.radians(10)
    verdict = judged(wedge(angle), from_above(), friction=0.4)
    total = sum(patch.force_object for patch in verdict.patches)
    # The jaws come from both sides, so that only the push toward the thick end is left.
    assert total[0] == pytest.approx(0.0, abs=1e-6)
    assert total[1] == pytest.approx(-2 * FORCE * np.tan(angle), rel=1e-3)
    assert verdict.settlement.preload_share == pytest.approx(np.tan(angle) / 0.4, rel=0.03)


@pytest.mark.parametrize("offset", [-0.005, 0.003, 0.006])
def test_a_cylinder_does_not_care_where_between_the_pads_it_stands(offset):
    verdict = judged(cylinder(), from_above(y=offset), friction=0.3)
    assert verdict.resists
    assert verdict.settlement.translation == 0.0
    assert verdict.settlement.preload_share < 0.1


def test_nor_does_a_frictionless_one_while_the_pads_cover_its_patch():
    inside = judged(cylinder(), from_above(y=0.004), friction=0.0)
    assert inside.settlement.translation < 2e-4 and inside.settlement.yaw < 1e-3
    assert inside.settlement.fate is Fate.SLIPPED_ON_LIFT  # nothing carries its weight


@pytest.mark.parametrize("offset", [-0.0115, 0.0115])
def test_a_frictionless_cylinder_is_expelled_once_the_rim_cuts_its_patch(offset):
    verdict = judged(cylinder(), from_above(y=offset), friction=0.0)
    assert verdict.settlement.fate is Fate.SQUEEZED_OUT
    assert verdict.settlement.path[-1][1, 3] * -offset > 0  # away from the pads


def test_a_frictionless_ball_stays_on_the_table_and_is_not_lifted():
    inside = judged(ball(), from_above(y=0.004), friction=0.0)
    assert inside.settlement.translation < 2e-4
    assert inside.settlement.fate is Fate.SLIPPED_ON_LIFT
    cut = judged(ball(), from_above(y=0.0112), friction=0.0)
    assert cut.settlement.fate is Fate.SQUEEZED_OUT


@pytest.mark.parametrize("part", [cube(), cylinder()], ids=["cube", "cylinder"])
def test_jaws_off_center_along_the_closing_axis_bring_the_part_to_the_middle(part):
    """The jaws are coupled: the part is pushed until both touch, and nothing else changes."""
    reference = judged(part, from_above(), friction=0.3)
    for x in (-0.008, 0.003, 0.008):
        shifted = judged(part, from_above(x=x), friction=0.3)
        assert shifted.settlement.pushed == pytest.approx(abs(x), abs=1e-4)
        assert shifted.settlement.path[-1][0, 3] == pytest.approx(x, abs=1e-4)
        assert shifted.settlement.yaw == pytest.approx(reference.settlement.yaw, abs=1e-2)
        assert shifted.margin == pytest.approx(reference.margin, rel=1e-2)
        assert "touches first" in shifted.explanation


def test_the_jaw_that_touches_first_turns_a_part_that_both_would_jam():
    flush = judged(cube(), from_above(np.radians(20), x=0.006), friction=0.3)
    assert np.degrees(flush.settlement.yaw) == pytest.approx(20, abs=3.5)
    jammed = judged(cube(), from_above(np.radians(20)), friction=0.8)
    turned = judged(cube(), from_above(np.radians(20), x=0.006), friction=0.8)
    assert np.degrees(jammed.settlement.yaw) < 1 < 4 < np.degrees(turned.settlement.yaw)
    assert turned.settlement.pushed > 0.005


def test_a_part_pushed_at_a_lever_turns_as_its_radius_of_gyration_says():
    """Without friction on the pad: a travel s at a lever r turns by s r / (k^2 + r^2)."""
    part, yaw, edge, travel = cube(), np.radians(20), 0.03, 1e-4
    points, _ = trimesh.sample.sample_surface(
        trimesh.Trimesh(part.vertices, part.faces), 20000, seed=1
    )
    square = (points[:, :2] ** 2).sum(axis=1).mean()
    lever = edge / np.sqrt(2) * np.sin(np.radians(45) - yaw)
    expected = travel * lever / (square + lever**2)
    pads, tree = pads_of(YUMI), mesh_tree(part)
    T = np.array(from_above(yaw, x=travel).T_object_gripper)
    up = T[:3, :3].T @ (0.0, 0.0, 1.0)
    hand = Hand(np.zeros(3), FORCE, 0.0, FOUNDATION_STIFFNESS, 0.03)
    gyration = gyration_about(spread_about(tree, np.zeros(3)), np.array([0.0, 0.0, 1.0]))
    assert gyration**2 == pytest.approx(square, rel=0.02)
    after, poses = push(
        tree, pads, T, hand, motions_on_table(up, np.array([1.0, 0.0, 0.0])), gyration,
        make_room(2), np.empty((0, 4, 4)), 1,
    )  # fmt: skip
    assert poses > 1
    angle = np.arccos(np.clip((np.trace(after[:3, :3].T @ T[:3, :3]) - 1) / 2, -1, 1))
    assert angle == pytest.approx(expected, rel=0.1)


def test_jaws_that_close_on_nothing_from_one_side_stop_in_the_middle():
    """The pad of one jaw is shifted past the part, so that only the other can push."""
    first, second = YUMI.jaws
    aside = transforms.make_transform(np.eye(3), (0.0, 0.045, 0.0))
    moved = Jaw(second.pad, aside @ second.T_gripper_pad_open)
    gripper = ParallelJawGripper("askew", (first, moved), 0.025, 20.0, 0.02)
    scene = Scene(cylinder(), gripper, np.eye(4))
    verdict = SettledContact().evaluate(scene, from_above())
    assert verdict.settlement.fate is Fate.NO_CONTACT and not verdict.resists
    assert verdict.settlement.pushed == pytest.approx(0.012, abs=1e-3)


def test_the_lift_adds_the_weight():
    heavy = judged(cube(mass=5.0), from_above())
    assert heavy.settlement.fate is Fate.SLIPPED_ON_LIFT and heavy.margin < 1
    assert "slips on the lift" in heavy.explanation
    carried = judged(cube(mass=1.0), from_above())
    assert carried.margin == pytest.approx(2 * 0.4 * FORCE / 9.81, rel=0.15)


def test_a_jammed_part_hangs_but_is_not_said_to_carry_so_much_more():
    """A steep wedge caught by its corner: out of balance, and yet stuck."""
    verdict = judged(
        wedge(np.radians(6)), from_above(np.radians(30), y=0.01, z=0.012), friction=0.8
    )
    assert verdict.settlement.fate is Fate.JAMMED
    assert verdict.resists and verdict.margin == 1.0 and verdict.reason is Reason.HOLDS
    assert verdict.settlement.residual > 0.03
    assert "jammed" in verdict.explanation and "times gravity" not in verdict.explanation
    held = judged(wedge(np.radians(6)), from_above(), friction=0.8)
    assert held.settlement.fate is Fate.HELD and held.margin > 1.0


def test_jaws_that_meet_nothing_say_so():
    verdict = judged(cube(), from_above(y=0.1))
    assert verdict.settlement.fate is Fate.NO_CONTACT and verdict.reason is Reason.NO_CONTACT
    assert verdict.missing_jaws == (0, 1) and verdict.explanation == "no contact on jaws 0 and 1"
    assert verdict.patches == ()


def potential(part, T_object_gripper, cell=2.5e-4):
    """Energy of both pads less f_C times their travel [J], by rays on a grid of columns."""
    raycast, total = RaycastScene(part.vertices, part.faces), 0.0
    for jaw in range(2):
        low, high = YUMI.jaws[jaw].pad.polygon.min(axis=0), YUMI.jaws[jaw].pad.polygon.max(axis=0)
        xs, ys = (np.arange(a + cell / 2, b, cell) for a, b in zip(low, high, strict=True))
        grid = np.stack(np.meshgrid(xs, ys, indexing="ij"), axis=-1).reshape(-1, 2)
        corner_cut = np.maximum(0, grid[:, 0] - 0.005) + np.maximum(0, np.abs(grid[:, 1]) - 0.005)
        grid = grid[corner_cut < 0.005]  # YuMi's outline
        T = T_object_gripper @ YUMI.T_gripper_pad(jaw)
        starts = grid @ T[:3, :2].T + T[:3, 3]
        depth, _ = raycast.cast(starts, np.broadcast_to(T[:3, 2], starts.shape))
        z = depth[np.isfinite(depth)]
        least, most = z.min(), z.min() + 0.02
        for _ in range(60):
            middle = 0.5 * (least + most)
            push = FOUNDATION_STIFFNESS * cell**2 * np.maximum(0, middle - z).sum()
            least, most = (middle, most) if push < FORCE else (least, middle)
        energy = 0.5 * FOUNDATION_STIFFNESS * cell**2 * (np.maximum(0, middle - z) ** 2).sum()
        total += energy - FORCE * middle
    return total


@pytest.mark.parametrize("case", ["cube", "wedge"])
def test_without_friction_the_potential_never_rises_while_settling(case):
    """Computed by rays, independently of the kernels."""
    part = cube() if case == "cube" else wedge(np.radians(12))
    grasp = from_above(np.radians(20)) if case == "cube" else from_above(y=-0.004)
    settlement = judged(part, grasp, friction=0.0).settlement
    on_table = settlement.path[: settlement.rest + 1]
    if settlement.fate is Fate.SQUEEZED_OUT:
        on_table = on_table[:-1]  # in the last pose a pad is empty
    values = np.array(
        [potential(part, transforms.inverse(T) @ grasp.T_object_gripper) for T in on_table]
    )
    assert len(values) > 10
    drop = values[0] - values[-1]
    assert drop > 1e-3
    assert np.diff(values).max() < 2e-3 * drop


def test_a_pad_that_presses_on_nothing_pushes_nothing():
    motions = motions_on_table(np.array([0.0, 0.0, 1.0]), np.array([1.0, 0.0, 0.0]))
    motion = np.full(3, np.nan)
    pushed_twist(motions, np.zeros(6), 3.0, 1.0, motion)
    np.testing.assert_array_equal(motion, 0.0)


def test_friction_of_the_pad_does_not_drag_a_part_that_is_pushed_aside():
    """Knocked at a lever, a cube turns; its center keeps its place across the closing axis."""
    verdicts = [judged(cube(), from_above(x=0.008, y=0.017), friction=mu) for mu in (0.0, 0.4)]
    for verdict in verdicts:
        path = verdict.settlement.path
        pushed = path[1 : verdict.settlement.rest + 1]
        assert len(pushed) > 3
        turned = np.arctan2(path[4][1, 0], path[4][0, 0])
        assert abs(turned) > np.radians(2) and abs(path[4][1, 3]) < 0.1 * abs(path[4][0, 3])
    np.testing.assert_allclose(verdicts[0].settlement.path[4], verdicts[1].settlement.path[4])
