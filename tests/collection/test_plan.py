from __future__ import annotations

from collections import Counter

import numpy as np
import pytest
import trimesh

from collection.errors import DuplicateNameError, NoGraspError, PlanError
from collection.objects import load_object
from collection.plan.plan import Plan, make_plan, repeat_plan
from collection.sampling import SamplingOptions
from collection.sampling.over_poses import sample_over_poses
from reach.gripper import ParallelJawGripper
from reach.objects import GraspObject
from reach.stable_poses import stable_poses
from reach.transforms import exp

YUMI = ParallelJawGripper.yumi()
NAMES = ("cube_3cm", "bracket", "knob")


@pytest.fixture(scope="module")
def parts() -> list[GraspObject]:
    return [load_object(name) for name in NAMES]


@pytest.fixture(scope="module")
def plan(parts) -> Plan:
    return make_plan(parts, YUMI, grasps=6, repeats=3, seed=7)


def test_every_grasp_is_tried_the_same_number_of_times(plan):
    assert len(plan.grasps) == 18 and len(plan.trials) == 54
    tried = Counter((trial.grasp_id, trial.repeat) for trial in plan.trials)
    assert set(tried.values()) == {1}
    assert tried.keys() == {(g.grasp_id, r) for g in plan.grasps for r in range(3)}
    assert [trial.number for trial in plan.trials] == list(range(1, 55))
    assert len({trial.trial_id for trial in plan.trials}) == 54


def test_every_stretch_of_the_session_holds_every_part_alike(plan):
    names = [trial.object_name for trial in plan.trials]
    for start in range(0, 54, 3):
        assert sorted(names[start : start + 3]) == sorted(NAMES)
    assert len({tuple(names[s : s + 3]) for s in range(0, 54, 3)}) > 1, "in random order"


def test_unequal_parts_are_spread_over_the_session():
    from collection.plan.plan import _ordered_trials
    from collection.plan.records import PlannedGrasp

    def grasps(name: str, number: int) -> list[PlannedGrasp]:
        return [
            PlannedGrasp(
                grasp_id=f"{name}{i}",
                object_name=name,
                stable_pose=0,
                T_object_gripper=np.eye(4),
                T_object_gripper_parent=np.eye(4),
                width=0.01,
                approach_angle=0.0,
                contacts_object=((0, 0, 0), (0, 0, 0.01)),
            )
            for i in range(number)
        ]

    trials = _ordered_trials(grasps("a", 40) + grasps("b", 10), range(2), seed=0, session=0)
    names = np.array([trial.object_name for trial in trials])
    for quarter in np.array_split(names, 4):
        assert abs((quarter == "b").mean() - 0.2) <= 0.08


def test_each_round_of_repeats_is_complete_before_the_next(plan):
    for name in NAMES:
        own = [trial.repeat for trial in plan.trials if trial.object_name == name]
        assert own == sorted(own)
        orders = [
            [t.grasp_id for t in plan.trials if t.object_name == name and t.repeat == r]
            for r in range(3)
        ]
        assert orders[0] != orders[1] or orders[1] != orders[2]


def test_one_process_or_two_give_one_plan(parts, plan):
    assert make_plan(parts, YUMI, grasps=6, repeats=3, seed=7, jobs=2) == plan


def test_json_round_trip_is_exact(plan):
    back = Plan.from_json(plan.to_json())
    assert back == plan
    assert back.content_hash == plan.content_hash
    for a, b in zip(plan.grasps, back.grasps, strict=True):
        assert a.T_object_gripper.tobytes() == b.T_object_gripper.tobytes()
        assert not b.T_object_gripper.flags.writeable


def test_what_is_not_a_plan_is_refused():
    with pytest.raises(PlanError, match="not a plan"):
        Plan.from_json('{"seed": 1}')


def test_another_seed_is_another_plan(parts, plan):
    other = make_plan(parts, YUMI, grasps=6, repeats=3, seed=8)
    assert other.content_hash != plan.content_hash
    assert not {t.trial_id for t in other.trials} & {t.trial_id for t in plan.trials}


def test_another_part_changes_no_part_s_grasps(parts, plan):
    alone = make_plan(parts[1:2], YUMI, grasps=6, repeats=3, seed=7)
    assert alone.grasps == tuple(g for g in plan.grasps if g.object_name == "bracket")


def test_a_further_session_adds_new_grasps_and_trials(parts, plan):
    second = make_plan(parts, YUMI, grasps=6, repeats=3, seed=7, session=1)
    assert not {g.grasp_id for g in second.grasps} & {g.grasp_id for g in plan.grasps}
    assert not {t.trial_id for t in second.trials} & {t.trial_id for t in plan.trials}
    ours = {g.T_object_gripper.tobytes() for g in plan.grasps}
    assert not ours & {g.T_object_gripper.tobytes() for g in second.grasps}


def test_a_further_session_can_repeat_the_same_grasps(plan):
    more = repeat_plan(plan, 2, seed=9, session=1)
    assert more.grasps == plan.grasps
    assert more.content_hash != plan.content_hash
    assert Plan.from_json(more.to_json()) == more
    assert Counter(t.repeat for t in more.trials) == {3: 18, 4: 18}
    assert not {t.trial_id for t in more.trials} & {t.trial_id for t in plan.trials}
    with pytest.raises(PlanError, match="session"):
        repeat_plan(plan, 2, seed=9, session=0)


def test_poses_are_drawn_by_probability():
    near_cube = load_object("near_cube")
    poses = stable_poses(near_cube)
    counts = np.zeros(len(poses))
    for seed in range(12):
        samples = sample_over_poses(near_cube, YUMI, poses, count=25, seed=seed)
        for pose, _ in samples.grasps:
            counts[pose.index] += 1
    total = counts.sum()
    expected = np.array([pose.probability for pose in poses])
    spread = np.sqrt(expected * (1 - expected) / total)
    assert (np.abs(counts / total - expected) < 4 * spread).all()


def test_a_plan_moves_with_the_mesh(parts):
    part = parts[1]
    T = exp([-0.3, 0.9, 0.5, 0.02, 0.3, -0.1])
    moved = GraspObject(part.name, part.vertices @ T[:3, :3].T + T[:3, 3], part.faces, part.mass)
    here = make_plan([part], YUMI, grasps=8, repeats=2, seed=5)
    there = make_plan([moved], YUMI, grasps=8, repeats=2, seed=5)
    assert here.trials == there.trials
    for a, b in zip(here.grasps, there.grasps, strict=True):
        assert a.stable_pose == b.stable_pose
        np.testing.assert_allclose(b.T_object_gripper, T @ a.T_object_gripper, atol=1e-6)


def test_each_grasp_knows_how_its_part_lies(plan, parts):
    by_name = {part.name: part for part in parts}
    for grasp in plan.grasps:
        pose = plan.pose_of(plan.grasp(grasp.grasp_id))
        known = stable_poses(by_name[grasp.object_name])[grasp.stable_pose]
        np.testing.assert_array_equal(pose.T_world_object, known.T_world_object)
    for part in plan.objects:
        assert sum(pose.grasps for pose in part.poses) == 6
        assert part.content_hash == by_name[part.name].content_hash
    with pytest.raises(PlanError, match="nothing"):
        plan.grasp("nothing")


def test_improbable_poses_are_left_out_on_demand(parts):
    likely = make_plan([parts[1]], YUMI, grasps=4, repeats=1, seed=0, min_probability=0.2)
    assert [pose.probability >= 0.2 for pose in likely.objects[0].poses] == [True] * 3


def test_an_arm_s_reach_is_respected(parts):
    plan = make_plan(parts[:1], YUMI, grasps=5, repeats=1, seed=3, reachable=_right_half)
    for grasp in plan.grasps:
        T_world_gripper = plan.pose_of(grasp).T_world_object @ grasp.T_object_gripper
        assert T_world_gripper[1, 3] < 0


def _right_half(T_world_gripper: np.ndarray) -> np.ndarray:
    return T_world_gripper[:, 1, 3] < 0


def test_what_cannot_be_planned_is_refused(parts):
    with pytest.raises(DuplicateNameError, match="bracket"):
        make_plan([parts[1], parts[1]], YUMI, seed=0)
    with pytest.raises(PlanError, match="no objects"):
        make_plan([], YUMI, seed=0)
    with pytest.raises(PlanError, match="repeats is 0"):
        make_plan(parts, YUMI, repeats=0, seed=0)
    with pytest.raises(NoGraspError, match="no stable pose"):
        make_plan(parts[1:2], YUMI, seed=0, min_probability=0.9)
    crate = trimesh.creation.box((0.2, 0.2, 0.2))
    big = GraspObject("crate", crate.vertices, crate.faces, 1.0)
    with pytest.raises(NoGraspError, match="cannot hold 'crate'"):
        make_plan([big], YUMI, seed=0, options=SamplingOptions(max_candidates=2000))
