"""What the settled model costs, and how much its scores depend on what is not known exactly.

    python benchmarks/settled_trials.py            # simulate first
    python benchmarks/settled_robustness.py [--grasps 8] [--samples 50] [--json OUT]

Each row changes one assumption of `settled-robust` and holds it against the same simulated
trials, on every second part.
"""

from __future__ import annotations

import argparse
import json
import time
from pathlib import Path
from typing import Any

import numpy as np
import trimesh
from settled import SCORE_SEED, cases_of
from settled_trials import ERRORS, YUMI, Run

from reach import transforms
from reach.evaluation.cases import GraspCase, Outcomes
from reach.evaluation.overlap import overlap_score
from reach.evaluation.table import mean_metrics
from reach.grasp import Grasp
from reach.models.defaults import FRICTION
from reach.models.settled import FOUNDATION_STIFFNESS, SettledContact
from reach.models.settled_score import settled_robust
from reach.objects import GraspObject
from reach.pose_error import PoseError
from reach.scene import Scene

ERROR = ERRORS["wide"]
CHANGES: dict[str, tuple[float, float, float]] = {
    "as it is": (1.0, FRICTION, 1.0),
    "k_w / 2": (0.5, FRICTION, 1.0),
    "k_w x 2": (2.0, FRICTION, 1.0),
    "friction .3": (1.0, 0.3, 1.0),
    "friction .6": (1.0, 0.6, 1.0),
    "friction .8": (1.0, 0.8, 1.0),
    "pose error / 2": (1.0, FRICTION, 0.5),
    "pose error x 2": (1.0, FRICTION, 2.0),
}
"""Factor of the pads' stiffness, friction, and factor of the pose error."""
VERDICTS = 400


def scores(cases: list[GraspCase], samples: int, change: tuple[float, float, float]) -> np.ndarray:
    stiffer, friction, wider = change
    scorer = settled_robust(
        samples=samples, stiffness=stiffer * FOUNDATION_STIFFNESS, friction=friction
    )
    error = PoseError.isotropic(
        translation=wider * ERROR.translation_deviation,
        rotation=wider * ERROR.rotation_deviation,
    )
    found = (scorer.score(c.scene, c.grasp, pose_error=error, seed=SCORE_SEED) for c in cases)
    return np.array([score.value for score in found])


def ball() -> GraspObject:
    mesh = trimesh.creation.icosphere(3, 0.018)
    mesh.vertices *= 1 + 0.1 * np.sin(250 * mesh.vertices[:, [1, 2, 0]])
    return GraspObject("dented ball", mesh.vertices, mesh.faces, 0.02)


def cost() -> dict[str, float]:
    """CPU time of one warm core."""
    rng = np.random.default_rng(0)
    part = ball()
    scene = Scene(part, YUMI, np.eye(4))
    T = []
    for _ in range(VERDICTS):
        down = transforms.rotation_about((0, 0, 1), rng.uniform(-3, 3)) @ np.diag([1.0, -1, -1])
        shift = rng.uniform(-0.006, 0.006, 3) + (0, 0, 0.160)
        T.append(transforms.make_transform(down, shift))
    grasps = [Grasp(each) for each in T]
    model, robust = SettledContact(), settled_robust()
    model.evaluate(scene, grasps[0])
    start = time.process_time()
    for grasp in grasps:
        model.evaluate(scene, grasp)
    single = time.process_time() - start
    start = time.process_time()
    for grasp in grasps[:20]:
        robust.score(scene, grasp, pose_error=ERROR)
    return {
        "faces": len(part.faces),
        "CPU ms a verdict": 1e3 * single / VERDICTS,
        "CPU ms a score of 100 samples": 1e3 * (time.process_time() - start) / 20,
    }


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--grasps", type=int, default=8)
    parser.add_argument("--samples", type=int, default=50)
    parser.add_argument("--json", type=Path)
    arguments = parser.parse_args()
    results: dict[str, Any] = {"cost": cost()}
    print(json.dumps(results["cost"]), flush=True)
    chosen = [t for t in Run("wide").trials() if t.number < arguments.grasps]
    names = list(dict.fromkeys(trials.object_name for trials in chosen))
    cases = cases_of([trials for trials in chosen if trials.object_name in names[1::2]])
    outcomes = Outcomes.of(cases)
    overlap = [overlap_score(c.scene, c.grasp, pose_error=ERROR, seed=SCORE_SEED) for c in cases]
    rows = {"oracle": np.array([c.rate for c in cases]), "overlap": np.array(overlap)}
    rows |= {name: scores(cases, arguments.samples, each) for name, each in CHANGES.items()}
    for name, values in rows.items():
        found_metrics = mean_metrics(outcomes, values)
        results[name] = {key: found_metrics[key] for key in ("ap", "ar", "mae", "brier")}
        shown = "  ".join(f"{key} {value:.3f}" for key, value in results[name].items())
        print(f"{name:16s} {shown}", flush=True)
    if arguments.json is not None:
        arguments.json.write_text(json.dumps(results, indent=1) + "\n")


if __name__ == "__main__":
    main()
