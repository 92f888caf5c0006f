"""The settled model against the pin world: agreement, ranking, calibration, and cost.

    python benchmarks/settled_trials.py            # simulate, can be stopped and taken up again
    python benchmarks/settled.py [--json OUT]      # compare on what has been simulated

Verdicts are compared trial by trial, on the same perturbed pose, friction and mass. Scores are
compared grasp by grasp; a score draws perturbations of its own. The grade is fitted on half of
the parts and judged on the other half, both ways.
"""

from __future__ import annotations

import argparse
import json
import time
from pathlib import Path
from typing import Any

import numpy as np
from scipy.optimize import minimize
from settled_trials import ERROR, YUMI, Trials, planned, trials_of

from reach.evaluation.cases import GraspCase, Outcomes
from reach.evaluation.compare import compare
from reach.evaluation.table import mean_metrics
from reach.kernels.pads import pads_of
from reach.kernels.tree import mesh_tree
from reach.models.area import AreaContact
from reach.models.base import check_batch
from reach.models.registry import make_scorer
from reach.models.settled import Settled, SettledContact
from reach.models.settled_grade import Grade, quantities
from reach.models.settled_score import settled_robust
from reach.models.settled_verdict import FATES
from reach.world.rollouts import Outcome

BINS = np.linspace(0.0, 1.0, 11)
SCORE_SEED = 1


def settled_trials(trials: Trials, model: SettledContact) -> Settled:
    batch = check_batch(
        trials.scene,
        trials.T_object_gripper,
        force=trials.grasp.force,
        friction=trials.friction,
        mass=trials.mass,
    )
    return model.settle(mesh_tree(trials.scene.object), pads_of(YUMI), batch)


def agreement(all_trials: list[Trials], told: list[Settled]) -> dict[str, Any]:
    """Share of trials on which a verdict and the pin world agree, by part and by fate."""
    rows: dict[str, list[np.ndarray]] = {}
    for trials, settled in zip(all_trials, told, strict=True):
        reach = AreaContact().evaluate_batch(
            trials.scene, trials.T_object_gripper, friction=trials.friction, mass=trials.mass
        )
        held = trials.outcome == Outcome.HELD
        columns = [held, settled.margin >= 1.0, reach.resists, settled.fate]
        rows.setdefault(trials.object_name, []).append(np.column_stack(columns)[trials.valid])
    parts = {name: np.concatenate(each) for name, each in rows.items()}
    everything = np.concatenate(list(parts.values()))
    return {
        "parts": {name: _agreement(each) for name, each in parts.items()},
        "all": _agreement(everything),
        "held by fate": {
            str(fate): [int(chosen.sum()), float(everything[chosen, 0].mean())]
            for code, fate in enumerate(FATES)
            if (chosen := everything[:, 3] == code).any()
        },
    }


def _agreement(row: np.ndarray) -> dict[str, float]:
    held, settled, reach = row[:, 0] == 1, row[:, 1] == 1, row[:, 2] == 1
    return {
        "trials": len(row),
        "rate": held.mean(),
        "settled rate": settled.mean(),
        "reach rate": reach.mean(),
        "settled agrees": (held == settled).mean(),
        "reach agrees": (held == reach).mean(),
        "settled says yes wrongly": (settled & ~held).mean(),
        "settled says no wrongly": (held & ~settled).mean(),
    }


def fit_grade(cases: list[GraspCase], samples: list[Settled]) -> Grade:
    """Maximum likelihood of the grasps' success rates, every part counting the same."""
    names = [case.object_name for case in cases]
    X = np.array([quantities(YUMI, settled) for settled in samples])
    Y = np.array([case.rate for case in cases])
    W = np.array([1.0 / names.count(name) for name in names])

    def loss(b: np.ndarray) -> float:
        z = X @ b
        return float(np.average(np.logaddexp(0.0, z) - Y * z, weights=W) + 1e-4 * b @ b)

    return Grade(*np.round(minimize(loss, np.zeros(X.shape[1])).x, 2))


def cross_fitted(cases: list[GraspCase], samples: list[Settled]) -> dict[str, Any]:
    """Scores of each half of the parts by a grade fitted on the other half."""
    names = list(dict.fromkeys(case.object_name for case in cases))
    scores, fitted = np.zeros(len(cases)), {}
    for half in (0, 1):
        left_out = {*names[half::2]}
        inside = [i for i, case in enumerate(cases) if case.object_name not in left_out]
        grade = fit_grade([cases[i] for i in inside], [samples[i] for i in inside])
        fitted[f"without half {half}"] = grade.version
        for i, case in enumerate(cases):
            if case.object_name in left_out:
                scores[i] = grade.chance(YUMI, samples[i])
    return {
        **fitted,
        "metrics": mean_metrics(Outcomes.of(cases), scores),
        "reliability diagram": reliability_diagram(cases, scores),
    }


def cases_of(all_trials: list[Trials]) -> list[GraspCase]:
    return [
        GraspCase(
            trials.object_name,
            f"{trials.object_name}-{trials.number}",
            trials.scene,
            trials.grasp,
            int((trials.outcome == Outcome.HELD)[trials.valid].sum()),
            int(trials.valid.sum()),
        )
        for trials in all_trials
        if trials.valid.any()
    ]


def reliability_diagram(cases: list[GraspCase], scores: np.ndarray) -> list[list[float]]:
    """Mean score, mean success rate and number of grasps in each tenth of the scores."""
    rates = np.array([case.rate for case in cases])
    bins = np.clip(np.digitize(scores, BINS) - 1, 0, len(BINS) - 2)
    return [
        [float(scores[bins == b].mean()), float(rates[bins == b].mean()), int((bins == b).sum())]
        for b in np.unique(bins)
    ]


def worst(cases: list[GraspCase], scores: np.ndarray, count: int = 10) -> list[list[Any]]:
    rates = np.array([case.rate for case in cases])
    order = np.argsort(-np.abs(scores - rates))[:count]
    return [[cases[i].grasp_id, round(float(scores[i]), 3), round(cases[i].rate, 3)] for i in order]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--json", type=Path)
    parser.add_argument("--grasps", type=int, default=25)
    parser.add_argument("--samples", type=int, default=20)
    parser.add_argument("--seed", type=int, default=7)
    arguments = parser.parse_args()
    found = (
        trials_of(*plan, arguments.samples, arguments.seed, simulate=False)
        for plan in planned(arguments.grasps, arguments.seed)
    )
    all_trials = [trials for trials in found if trials is not None]
    model = SettledContact()
    settled_trials(all_trials[0], model)
    start = time.process_time()
    told = [settled_trials(trials, model) for trials in all_trials]
    cost = (time.process_time() - start) / (arguments.samples * len(all_trials))
    cases = cases_of(all_trials)
    scorers = [make_scorer(name) for name in ("settled-robust", "reach-robust", "settled", "reach")]
    table = compare(cases, scorers, pose_error=ERROR, seed=SCORE_SEED, use_cache=False)
    robust = settled_robust()
    samples = [robust.settled_samples(c.scene, c.grasp, ERROR, SCORE_SEED) for c in cases]
    shares = np.array([(settled.margin >= 1.0).mean() for settled in samples])
    graded = table.row("settled-robust").scores
    results = {
        "grasps": len(cases),
        "parts": len({case.object_name for case in cases}),
        "trials": int(sum(case.trials for case in cases)),
        "started inside part or table": int(sum((~t.valid).sum() for t in all_trials)),
        "CPU ms a verdict": 1e3 * cost,
        "agreement": agreement(all_trials, told),
        "grade fitted on all": fit_grade(cases, samples).version,
        "grade fitted on the other half": cross_fitted(cases, samples),
        "table": {row.name: row.mean for row in table.rows},
        "above overlap": {row.name: row.above_overlap for row in table.rows if row.above_overlap},
        "settled-robust, plain share": mean_metrics(Outcomes.of(cases), shares),
        "reliability diagram": reliability_diagram(cases, graded),
        "seconds a grasp": {row.name: row.seconds_per_grasp for row in table.rows},
        "worst": worst(cases, graded),
    }
    text = json.dumps(results, indent=1)
    print(text)
    if arguments.json is not None:
        arguments.json.write_text(text + "\n")


if __name__ == "__main__":
    main()
