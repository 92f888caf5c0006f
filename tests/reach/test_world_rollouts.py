"""Batches of simulated lifts: outcomes, early exit, and the same bits on any number of threads."""

from __future__ import annotations

import hashlib
import subprocess
import sys

import numpy as np
import pytest
import trimesh

from reach.errors import InvalidInputError
from reach.grasp import Grasp
from reach.gripper import ParallelJawGripper
from reach.models.dynamic import make_dynamic
from reach.models.registry import make_scorer
from reach.objects import GraspObject
from reach.pose_error import PoseError
from reach.scene import Scene
from reach.transforms import inverse, make_transform, rotation_about
from reach.world.rollouts import Outcome, simulate_grasps

YUMI = ParallelJawGripper.yumi()


def cube(mass: float = 0.003) -> GraspObject:
    mesh = trimesh.creation.box((0.03, 0.03, 0.03))
    return GraspObject("cube", mesh.vertices, mesh.faces, mass)


SCENE = Scene(cube(), YUMI, make_transform(None, (0, 0, 0.015)))


def grasp_at(x: float = 0.0, height: float = 0.0, yaw: float = 0.0) -> np.ndarray:
    """T_object_gripper from above, off the cube's center."""
    down = rotation_about((0, 0, 1), yaw) @ np.diag([1.0, -1.0, -1.0])
    return np.array(make_transform(down, (x, 0.0, height + 0.160098)))


def test_outcomes_tell_held_missed_and_blocked_apart() -> None:
    beside = np.array(make_transform(None, (0, 0.08, 0))) @ grasp_at()
    blocked = grasp_at(x=0.03)  # a finger starts inside the cube
    outcomes = simulate_grasps(SCENE, np.array([grasp_at(), beside, blocked]))
    assert outcomes.outcome.tolist() == [Outcome.HELD, Outcome.EMPTY, Outcome.COLLISION]
    assert outcomes.lifted.tolist() == [True, False, False]
    assert outcomes.clearance[0] == pytest.approx(0.1, abs=2e-3)
    assert outcomes.opening[0] == pytest.approx(0.03, abs=2e-3)
    assert outcomes.turned[0] < 0.02


def test_a_part_without_friction_is_dropped() -> None:
    outcomes = simulate_grasps(SCENE, grasp_at()[None], friction=np.array([0.001]))
    heavy = simulate_grasps(SCENE, grasp_at()[None], mass=np.array([3.0]))
    assert outcomes.outcome.tolist() == [Outcome.DROPPED]
    assert heavy.outcome.tolist() == [Outcome.DROPPED]


def test_decided_samples_leave_early() -> None:
    beside = np.array(make_transform(None, (0, 0.08, 0))) @ grasp_at()
    outcomes = simulate_grasps(SCENE, np.array([grasp_at(), beside]))
    assert outcomes.simulated[1] < 0.35  # closed on nothing: never lifted
    assert 0.7 < outcomes.simulated[0] < 1.2  # held still at the top: no need of the full hold


def test_the_same_bits_on_one_thread_and_two() -> None:
    rng = np.random.default_rng(3)
    poses = np.array(
        [grasp_at(rng.uniform(-0.02, 0.02), 0.0, rng.uniform(-1, 1)) for _ in range(16)]
    )
    friction = rng.uniform(0.1, 0.6, 16)
    one = simulate_grasps(SCENE, poses, friction=friction, threads=1)
    two = simulate_grasps(SCENE, poses, friction=friction, threads=2)
    for name in ("outcome", "clearance", "opening", "turned", "simulated"):
        np.testing.assert_array_equal(getattr(one, name), getattr(two, name))
    assert 0 < one.lifted.sum() < 16  # the comparison would be empty if all were alike


def digest_of_outcomes() -> str:
    """Digest of every bit of some outcomes, lifted and not."""
    rng = np.random.default_rng(5)
    poses = np.array(
        [grasp_at(rng.uniform(-0.02, 0.02), 0.0, rng.uniform(-1, 1)) for _ in range(8)]
    )
    outcomes = simulate_grasps(SCENE, poses, friction=rng.uniform(0.1, 0.6, 8), threads=1)
    arrays = (outcomes.outcome, outcomes.clearance, outcomes.opening, outcomes.turned)
    return hashlib.sha256(b"".join(each.tobytes() for each in arrays)).hexdigest()


def test_two_processes_get_the_same_bits_as_this_one() -> None:
    program = "import runpy, sys; print(runpy.run_path(sys.argv[1])['digest_of_outcomes']())"
    others = [
        subprocess.Popen(
            [sys.executable, "-c", program, __file__], stdout=subprocess.PIPE, text=True
        )
        for _ in range(2)
    ]
    digests = {other.communicate(timeout=120)[0].strip() for other in others}
    assert digests == {digest_of_outcomes()}


def test_the_dynamic_score_is_seeded_and_independent_of_threads() -> None:
    grasp = Grasp(np.array(make_transform(None, (0, 0.022, 0))) @ grasp_at())
    error = PoseError.isotropic(translation=3e-3, rotation=0.02)
    scores = [
        make_scorer("dynamic", samples=24, threads=threads).score(
            SCENE, grasp, pose_error=error, seed=seed
        )
        for threads, seed in ((1, 5), (2, 5), (2, 6))
    ]
    assert scores[0].value == scores[1].value
    assert scores[0].details == scores[1].details
    assert 0 < scores[0].value < 1
    assert scores[1].details["mean_turned"] != scores[2].details["mean_turned"]


def test_the_dynamic_model_prefers_the_better_grasp() -> None:
    scorer = make_dynamic(samples=20)
    good, bad = scorer.score_many(
        SCENE,
        [Grasp(grasp_at()), Grasp(np.array(make_transform(None, (0, 0.022, 0))) @ grasp_at())],
        pose_error=PoseError.isotropic(translation=2e-3, rotation=0.02),
        seed=1,
    )
    assert good.value > 0.9
    assert bad.value < good.value


def test_bad_parameters_are_refused() -> None:
    for wrong in ({"samples": 0}, {"friction": -1.0}, {"pad_modulus": float("nan")}):
        with pytest.raises(InvalidInputError):
            make_scorer("dynamic", **wrong)
    with pytest.raises(InvalidInputError, match="outside"):
        simulate_grasps(SCENE, grasp_at()[None], opening=0.08)


def test_jaws_may_start_half_open() -> None:
    wide = simulate_grasps(SCENE, grasp_at()[None])
    narrow = simulate_grasps(SCENE, grasp_at()[None], opening=0.036)
    assert narrow.lifted.all()
    assert narrow.opening[0] == pytest.approx(wide.opening[0], abs=5e-4)


def test_gravity_acts_in_the_world_not_in_the_object() -> None:
    """The same grasp on a cube that lies on another side, seen from the table, does the same."""
    roll = rotation_about((1, 0, 0), np.pi / 2)
    T_world_object = make_transform(roll, (0, 0, 0.015))
    T_world_gripper = SCENE.T_world_object @ grasp_at()
    rolled = simulate_grasps(
        Scene(cube(), YUMI, T_world_object), (inverse(T_world_object) @ T_world_gripper)[None]
    )
    assert rolled.lifted.all()
    assert rolled.clearance[0] == pytest.approx(0.1, abs=2e-3)
