"""Many parameter sets scored together give what each gives alone, and survive Ctrl-C."""

import os
import signal
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import trimesh

from reach.evaluation.cases import GraspCase
from reach.evaluation.cross_validation import draw_parameters
from reach.evaluation.scoring import score_cases, score_draws
from reach.grasp import Grasp
from reach.gripper import ParallelJawGripper
from reach.models.draws import scores_of_draws, share_work
from reach.models.registry import make_scorer
from reach.objects import GraspObject
from reach.pose_error import PoseError
from reach.scene import Scene
from reach.transforms import make_transform, rotation_about

ERROR = PoseError.isotropic(translation=2e-3, rotation=2e-2)
YUMI = ParallelJawGripper.yumi()
PAD_HEIGHT = float(YUMI.T_gripper_pad(0)[2, 3])


def cases(count=3):
    """Grasps on a heavy ring (concave: a pad can reach two walls) that some samples hold."""
    mesh = trimesh.creation.annulus(0.006, 0.017, 0.03, sections=24)
    part = GraspObject("ring", mesh.vertices, mesh.faces, mass=1.8)
    rng = np.random.default_rng(5)
    found = []
    for number in range(count):
        turned = rotation_about((0, 0, 1), rng.uniform(-1, 1)) @ rotation_about((1, 0, 0), np.pi)
        offset = rng.uniform((-0.003, -0.012, -0.006), (0.003, 0.012, 0.006))
        T = make_transform(turned, offset - turned @ (0, 0, PAD_HEIGHT))
        grasp = Grasp(T, opening=0.04 if number else None)
        scene = Scene(part, YUMI, make_transform(None, (0.4, 0, 0.015)))
        found.append(GraspCase("ring", f"ring/{number}", scene, grasp, number % 2, 1))
    return found


@pytest.fixture(autouse=True)
def own_cache(tmp_path, monkeypatch):
    monkeypatch.setattr("reach.evaluation.score_cache.cache_folder", lambda: tmp_path / "cache")


def scorers(name, draws, **given):
    keys = set(make_scorer(name).parameters)
    return [
        make_scorer(name, **{k: v for k, v in draw.items() if k in keys}, **given) for draw in draws
    ]


@pytest.mark.parametrize(
    ("name", "given"),
    [
        ("point", {}),
        ("ellipse", {"saturate": False}),
        ("reach", {"saturate": True}),
        ("point-robust", {"samples": 20}),
        ("ellipse-robust", {"samples": 20, "saturate": True}),
        ("ellipse-robust", {"samples": 20, "saturate": False}),
        ("reach-robust", {"samples": 20, "saturate": True}),
        ("reach-robust", {"samples": 20, "saturate": False}),
    ],
)
def test_together_as_alone(name, given):
    some = cases()
    sets = scorers(name, draw_parameters(seed=1, count=8), **given)
    assert share_work(sets)
    together = score_draws(some, sets, pose_error=ERROR)
    alone = [score_cases(some, one, pose_error=ERROR, use_cache=False).values for one in sets]
    np.testing.assert_array_equal(together, alone)
    if "robust" in name:
        assert len(np.unique(together)) > 3  # the draws differ, and the samples


def test_equal_frictions_and_a_hand_that_misses():
    sets = scorers("reach-robust", [{"friction": 0.5}, {"friction": 0.5}], samples=10)
    one = cases(1)[0]
    first, second = scores_of_draws(sets, one.scene, one.grasp, pose_error=ERROR, seed=0)
    assert first == second > 0
    away = Grasp(make_transform(None, (0.3, 0, 0)))
    assert not scores_of_draws(sets, one.scene, away, pose_error=ERROR, seed=0).any()


def test_what_cannot_be_shared_is_scored_one_by_one():
    """A scorer of another kind, other samples, another margin: each alone, with the same result."""
    reach = make_scorer("reach-robust", samples=5)
    for other in (
        make_scorer("point-robust", samples=5),
        make_scorer("reach-robust", samples=6),
        make_scorer("reach-robust", samples=5, margin_cap=2.0),
        make_scorer("reach-robust", samples=5, pose_translation=2e-3),
        make_scorer("reach"),
    ):
        assert not share_work([reach, other])
    assert not share_work([make_scorer("settled"), make_scorer("settled", friction=0.5)])
    mixed = [reach, make_scorer("point")]
    values = score_draws(cases(), mixed, pose_error=ERROR)
    for row, scorer in zip(values, mixed, strict=True):
        alone = score_cases(cases(), scorer, pose_error=ERROR, use_cache=False)
        np.testing.assert_array_equal(row, alone.values)


RUN = """
import test_evaluation_draws as tests

tests.interruptible(lambda done, total: print(done, flush=True))
"""


def interruptible(progress):
    return score_draws(
        cases(6),
        scorers("reach-robust", draw_parameters(0, 60), saturate=False),
        pose_error=ERROR,
        backend="threading",
        progress=progress,
    )


def test_ctrl_c_costs_only_the_grasps_under_way(tmp_path, monkeypatch):
    """A run that is interrupted leaves its finished grasps to the next one, which ends alike."""
    paths = os.pathsep.join([str(Path(__file__).parent), os.environ.get("PYTHONPATH", "")])
    run = subprocess.Popen(
        [sys.executable, "-c", RUN],
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        text=True,
        env=os.environ | {"REACH_CACHE": str(tmp_path / "cache"), "PYTHONPATH": paths},
    )
    for line in run.stdout:
        if line.strip() == "2":
            run.send_signal(signal.SIGINT)
            break
    run.communicate(timeout=120)
    assert run.returncode != 0
    done = []
    resumed = interruptible(lambda count, total: done.append(count))
    assert 2 <= done[0] < 6 and done[-1] == 6
    monkeypatch.setattr("reach.evaluation.score_cache.cache_folder", lambda: tmp_path / "other")
    np.testing.assert_array_equal(resumed, interruptible(None))
