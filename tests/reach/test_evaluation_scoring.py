"""Scoring in any way gives the same, survives interruption, and is not done twice."""

import json
import os
import subprocess
import sys
import time
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import pytest
import trimesh

from reach.errors import InvalidInputError, UnknownNameError
from reach.evaluation.backends import cluster
from reach.evaluation.cases import GraspCase, Outcomes
from reach.evaluation.compare import compare
from reach.evaluation.cross_validation import (
    choose,
    cross_validate,
    draw_parameters,
    drawable,
    variants,
)
from reach.evaluation.overlap import closed_width, overlap_score, pressed_shares
from reach.evaluation.scored import ScoredModel
from reach.evaluation.scoring import score_cases
from reach.evaluation.table import tabulate
from reach.grasp import Grasp
from reach.gripper import ParallelJawGripper
from reach.models.registry import make_scorer
from reach.objects import GraspObject
from reach.pose_error import PoseError
from reach.scene import Scene
from reach.transforms import make_transform, rotation_about

ERROR = PoseError.isotropic(translation=1e-3, rotation=3e-3)
YUMI = ParallelJawGripper.yumi()
PAD_HEIGHT = float(YUMI.T_gripper_pad(0)[2, 3])


def block(name="block", extents=(0.03, 0.02, 0.03)):
    mesh = trimesh.creation.box(extents)
    return GraspObject(name, mesh.vertices, mesh.faces, mass=0.02)


def from_above(offset=(0.0, 0.0, 0.0), yaw=0.0):
    """Hand pointing down, closing along the object's x turned by yaw, pads at an offset."""
    rotation = rotation_about((0, 0, 1), yaw) @ rotation_about((1, 0, 0), np.pi)
    return make_transform(rotation, np.array(offset) - rotation @ (0, 0, PAD_HEIGHT))


def cases(objects=2, grasps=6, seed=0):
    rng = np.random.default_rng(seed)
    result = []
    for k in range(objects):
        part = block(f"block {k}", (0.03, 0.02 + 0.002 * k, 0.03))
        scene = Scene(part, YUMI, make_transform(None, (0.4, 0, 0.015)))
        for g in range(grasps):
            T = from_above(rng.uniform(-0.012, 0.012, 3), rng.uniform(-1, 1))
            lifted = int(rng.integers(0, 6))
            result.append(GraspCase(part.name, f"{part.name}/{g}", scene, Grasp(T), lifted, 5))
    return result


@pytest.fixture(autouse=True)
def own_cache(tmp_path, monkeypatch):
    # Only scores: compiled kernels stay where they are.
    monkeypatch.setattr("reach.evaluation.score_cache.cache_folder", lambda: tmp_path / "cache")


@dataclass
class CountingScorer:
    """Scores by the grasp's height, and counts how often it is asked."""

    name: str = "counting"
    version: str = "1"
    parameters: dict = field(default_factory=lambda: {"friction": 0.5})
    calls: int = 0
    fail_after: int = 10**9
    asked: list = field(default_factory=list)

    def score(self, scene, grasp, *, pose_error, seed):
        self.calls += 1
        self.asked.append(scene.object.name)
        if self.calls > self.fail_after:
            raise KeyboardInterrupt
        value = (abs(grasp.T_object_gripper[0, 3]) * 40) % 1.0
        return _Value(value)


@dataclass
class _Value:
    value: float


def test_scores_are_cached_by_content():
    first = CountingScorer()
    a = score_cases(cases(), first, pose_error=ERROR)
    assert first.calls == 12
    again = CountingScorer()
    b = score_cases(cases()[::-1], again, pose_error=ERROR)
    assert again.calls == 10  # only to measure the time
    assert set(again.asked) == {"block 0", "block 1"}  # of grasps from all over the list
    np.testing.assert_array_equal(a.values, b.values[::-1])
    assert b.seconds_per_grasp > 0
    for changed, error, seed in [
        (CountingScorer(version="2"), ERROR, 0),
        (CountingScorer(parameters={"friction": 0.6}), ERROR, 0),
        (CountingScorer(), PoseError.isotropic(translation=2e-3, rotation=3e-3), 0),
        (CountingScorer(), ERROR, 1),
    ]:
        score_cases(cases(), changed, pose_error=error, seed=seed)
        assert changed.calls == 12
    heavier = CountingScorer()
    part = cases()[0].scene.object
    other = GraspObject(part.name, part.vertices, part.faces, mass=0.5)
    one = cases()[0]
    moved = GraspCase("x", "x", Scene(other, YUMI, one.scene.T_world_object), one.grasp, 1, 2)
    score_cases([moved], heavier, pose_error=ERROR)
    assert heavier.calls == 1


def test_scores_of_other_code_are_not_taken_from_the_cache(monkeypatch):
    """Whatever the version says: who scored before a change must not get the old numbers after it."""
    score_cases(cases(), CountingScorer(), pose_error=ERROR)
    monkeypatch.setattr("reach.evaluation.scoring.source_digest", lambda: "after a change")
    changed = CountingScorer()
    score_cases(cases(), changed, pose_error=ERROR)
    assert changed.calls == 12


def test_an_interrupted_run_goes_on_where_it_stopped():
    killed = CountingScorer(fail_after=5)
    with pytest.raises(KeyboardInterrupt):
        score_cases(cases(), killed, pose_error=ERROR)
    rest = CountingScorer()
    seen = []
    scored = score_cases(
        cases(), rest, pose_error=ERROR, progress=lambda done, total: seen.append((done, total))
    )
    assert rest.calls == 7
    assert seen[0] == (5, 12) and seen[-1] == (12, 12)
    fresh = score_cases(cases(), CountingScorer(), pose_error=ERROR, use_cache=False)
    np.testing.assert_array_equal(scored.values, fresh.values)


def test_a_torn_or_nonsense_cache_line_costs_one_score(tmp_path):
    score_cases(cases(), CountingScorer(), pose_error=ERROR)
    (path,) = (tmp_path / "cache" / "scores").iterdir()
    lines = path.read_text().splitlines(keepends=True)
    lines[3] = "[1, 2, 3]\n"
    lines[4] = json.dumps([json.loads(lines[4])[0], 7.0]) + "\n"
    path.write_text("".join(lines)[:-4])
    again = CountingScorer()
    score_cases(cases(), again, pose_error=ERROR)
    assert again.calls == 3
    last = CountingScorer()
    score_cases(cases(), last, pose_error=ERROR)
    assert last.calls == 10  # the torn line did not spoil the one written after it


def test_scores_state_the_pose_error_they_were_computed_under():
    scorer = make_scorer("reach-robust", samples=4)
    error = PoseError.isotropic(translation=2.5e-3, rotation=7e-3)
    given = score_cases(cases(objects=1, grasps=2), scorer, pose_error=error)
    assert given.parameters["pose_translation"] == pytest.approx(2.5e-3)
    assert given.parameters["pose_rotation"] == pytest.approx(7e-3)
    own = score_cases(cases(objects=1, grasps=2), scorer, pose_error=None)
    assert own.parameters == scorer.parameters != given.parameters


def test_real_models_score_the_same_in_threads_as_in_order():
    scorer = make_scorer("reach-robust", samples=10)
    some = cases(objects=1, grasps=6)
    runs = [
        score_cases(some, scorer, pose_error=ERROR, backend=backend, jobs=2, use_cache=False).values
        for backend in ("serial", "threading")
    ]
    np.testing.assert_array_equal(*runs)


@pytest.mark.slow
@pytest.mark.skipif(
    os.environ.get("REACH_SLOW") != "1",
    reason="two processes load all libraries anew; the cluster test covers it (REACH_SLOW=1 runs it)",
)
def test_processes_give_the_same():
    some, scorer = cases(objects=1, grasps=4), make_scorer("point-robust", samples=10)
    serial = score_cases(some, scorer, pose_error=ERROR, use_cache=False)
    loky = score_cases(some, scorer, pose_error=ERROR, backend="loky", jobs=2, use_cache=False)
    np.testing.assert_array_equal(serial.values, loky.values)


def test_unknown_backend_and_misplaced_scheduler_are_refused():
    with pytest.raises(UnknownNameError, match="dask, loky, serial, threading"):
        score_cases(cases(), CountingScorer(), pose_error=ERROR, backend="mpi")
    with (
        pytest.raises(InvalidInputError, match="is for --backend dask"),
        cluster("serial", "tcp://1"),
    ):
        pass


@dataclass
class SlowScorer:
    """Takes long enough for its worker to be killed meanwhile."""

    marks: str
    name: str = "slow"
    version: str = "1"
    parameters: dict = field(default_factory=dict)

    def score(self, scene, grasp, *, pose_error, seed):
        Path(self.marks, f"{os.getpid()}-{time.monotonic_ns()}").touch()
        time.sleep(0.25)
        return _Value((abs(grasp.T_object_gripper[0, 3]) * 40) % 1.0)


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore")
def test_a_killed_dask_worker_changes_nothing(tmp_path):
    """A worker dies in the middle; the cluster's result is the serial one."""
    marks = tmp_path / "marks"
    marks.mkdir()
    script = tmp_path / "cluster_run.py"
    script.write_text(CLUSTER_RUN)
    run = subprocess.run(
        [sys.executable, str(script), str(marks)],
        capture_output=True,
        text=True,
        timeout=120,
        check=False,
        env=os.environ | {"PYTHONPATH": str(Path(__file__).parent)},
    )
    assert run.returncode == 0, run.stderr[-2000:]
    found = json.loads(run.stdout.splitlines()[-1])
    assert found["killed"] in found["workers_seen"]
    assert len(found["workers_seen"]) >= 2
    some = cases(objects=2, grasps=8)
    serial = score_cases(some, CountingScorer(), pose_error=ERROR, use_cache=False)
    assert found["values"] == serial.values.tolist()


CLUSTER_RUN = """
import json, os, signal, sys, threading, time
from pathlib import Path
from distributed import Client, LocalCluster
import test_evaluation_scoring as tests

def main(marks):
    killed = []
    def kill_one():
        while len(list(marks.iterdir())) < 5:
            time.sleep(0.02)
        victim = int(sorted(marks.iterdir())[0].name.split("-")[0])
        os.kill(victim, signal.SIGKILL)
        killed.append(victim)
    with LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None) as local:
        with Client(local):
            threading.Thread(target=kill_one, daemon=True).start()
            scored = tests.score_cases(
                tests.cases(objects=2, grasps=8), tests.SlowScorer(str(marks)),
                pose_error=tests.ERROR, backend="dask", use_cache=False,
            )
    seen = sorted({int(path.name.split("-")[0]) for path in marks.iterdir()})
    print(json.dumps(dict(values=scored.values.tolist(), killed=killed[0], workers_seen=seen)))

if __name__ == "__main__":
    main(Path(sys.argv[1]))
"""


def test_overlap_of_a_centered_and_a_shifted_grasp():
    part = block(extents=(0.03, 0.03, 0.03))
    scene = Scene(part, YUMI, make_transform(None, (0.4, 0, 0.015)))
    centered = overlap_score(scene, Grasp(from_above()), pose_error=None)
    # The cube covers the pad's width; along the approach the pad reaches 10 mm ahead of and
    # 15 mm behind the cube's middle, of 27.5 mm.
    assert centered == pytest.approx(1 - 2.5 * 20 / (27.5 * 20 - 25), abs=0.02)
    half = overlap_score(scene, Grasp(from_above((0, 0.015, 0))), pose_error=None)
    assert half == pytest.approx(centered / 2, abs=0.02)
    assert overlap_score(scene, Grasp(from_above((0, 0.05, 0))), pose_error=None) == 0
    noisy = overlap_score(scene, Grasp(from_above((0, 0.015, 0))), pose_error=ERROR, samples=40)
    assert noisy == pytest.approx(half, abs=0.03)


def test_overlap_does_not_care_where_the_part_is_along_the_closing_axis():
    part = block(extents=(0.03, 0.03, 0.03))
    shares = [
        pressed_shares(part, YUMI, jaw, from_above((shift, 0, 0))[None])[0]
        for jaw in (0, 1)
        for shift in (-0.0105, 0.0, 0.0105)
    ]
    assert np.ptp(shares) == 0


def test_closed_width_is_the_blocks():
    part = block(extents=(0.031, 0.02, 0.03))
    assert closed_width(part, YUMI, from_above()) == pytest.approx(0.031, abs=3e-5)
    assert closed_width(part, YUMI, from_above(yaw=np.pi / 2)) == pytest.approx(0.02, abs=3e-5)
    assert closed_width(part, YUMI, from_above((0, 0.05, 0))) is None


def test_compare_gives_models_and_references():
    result = compare(cases(), [make_scorer("reach"), make_scorer("point")], pose_error=ERROR)
    assert [row.name for row in result.rows] == ["reach", "point", "constant", "overlap", "oracle"]
    content = json.loads(json.dumps(result.to_json()))
    assert content["references"] == ["constant", "overlap", "oracle"]
    for row in content["models"].values():
        assert {"ap", "ar", "f1", "mae", "brier", "seconds_per_grasp"} <= set(row)
    assert content["models"]["oracle"]["mae"] == 0
    assert content["models"]["constant"]["ar"] == 1
    best = content["models"]["oracle"]["ap"]
    assert all(row["ap"] <= best + 1e-12 for row in content["models"].values())
    with pytest.raises(UnknownNameError, match="valid: constant"):
        result.row("nobody")


def test_table_names_objects_without_a_success():
    some = cases()
    lost = [GraspCase(c.object_name, c.grasp_id, c.scene, c.grasp, 0, 5) for c in some[6:]]
    result = tabulate(some[:6] + lost, [ScoredModel("m", "1", {}, np.full(12, 0.5), 0.0)])
    assert result.to_json()["objects_without_positive"] == ["block 1"]
    row = result.row("m")
    assert row.per_object["block 1"]["ap"] is None
    assert row.mean["ap"] == row.per_object["block 0"]["ap"]
    with pytest.raises(InvalidInputError, match="score 1.5"):
        tabulate(some, [ScoredModel("m", "1", {}, np.full(12, 1.5), 0.0)])
    with pytest.raises(InvalidInputError, match="no labeled grasp"):
        tabulate([], [])
    with pytest.raises(InvalidInputError, match="stands for two grasps"):
        Outcomes.of([some[0], some[0]])
    with pytest.raises(InvalidInputError, match="7 successes in 5 trials"):
        GraspCase("a", "b", some[0].scene, some[0].grasp, 7, 5)


def test_cross_validation_never_sees_the_object_it_judges():
    """By construction: draw 0 is perfect on all but the first object, draw 1 on the first only."""
    outcomes = Outcomes.of(cases(objects=4, grasps=6))
    rates = np.concatenate([one.rates for one in outcomes.objects])
    draw_0, draw_1 = rates.copy(), 1 - rates
    draw_0[outcomes.indices[0]], draw_1[outcomes.indices[0]] = (
        1 - rates[outcomes.indices[0]],
        rates[outcomes.indices[0]],
    )
    found = choose(
        outcomes, np.array([draw_0, draw_1]), [{"friction": 1.0}, {"friction": 2.0}], "m", None
    )
    chosen = [held.draw for held in found.objects.values()]
    assert chosen[0] == 0  # best on the other three, although it is the worst on this one
    np.testing.assert_array_equal(found.scores[outcomes.indices[0]], draw_0[outcomes.indices[0]])
    assert found.objects["block 0"].metrics["mae"] == pytest.approx(
        np.abs(1 - 2 * outcomes.objects[0].rates).mean()
    )


def test_cross_validation_end_to_end_is_resumable():
    draws = draw_parameters(seed=3, count=4)
    assert draws == draw_parameters(seed=3, count=4)
    assert all(0.3 <= d["friction"] <= 1.5 and 1e-4 <= d["compliance"] <= 1e-2 for d in draws)
    seen = []
    results = [
        cross_validate(
            cases(objects=3, grasps=4),
            make_scorer,
            "reach",
            draws,
            saturated=saturated,
            pose_error=ERROR,
            progress=lambda name, done, total: seen.append((done, total)),
        )
        for saturated in (True, True, False)
    ]
    assert results[0].to_json() == results[1].to_json()
    assert seen[-1] == (12, 12)
    assert set(results[2].objects) == {"block 0", "block 1", "block 2"}
    assert results[0].mean["ap"] is not None
    assert "compliance" in results[0].objects["block 0"].parameters
    assert "torsion" not in results[0].objects["block 0"].parameters
    with pytest.raises(InvalidInputError, match="at least two objects"):
        cross_validate(
            cases(objects=1), make_scorer, "reach", draws, saturated=True, pose_error=ERROR
        )


def test_which_models_are_drawn():
    assert variants(make_scorer, "reach") == [True, False]
    assert variants(make_scorer, "point") == [None]
    assert drawable(make_scorer, "ellipse-robust") and drawable(make_scorer, "point")
    assert not drawable(make_scorer, "dynamic")
