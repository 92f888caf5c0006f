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
from reach.models.settled_verdict import FATES
from reach.world.rollouts import Outcome

BINS = np.linspace(0.0, 1.0, 11)


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


def fit_grade(all_trials: list[Trials], told: list[Settled]) -> Grade:
    """Maximum likelihood of the trials' outcomes, every part counting the same."""
    names = [trials.object_name for trials in all_trials]
    x, y, w = [], [], []
    for trials, settled in zip(all_trials, told, strict=True):
        x.append(quantities(YUMI, settled)[trials.valid])
        y.append((trials.outcome == Outcome.HELD)[trials.valid])
        w.append(np.full(len(y[-1]), 1.0 / names.count(trials.object_name)))
    X, Y, W = np.concatenate(x), np.concatenate(y).astype(float), np.concatenate(w)

    def loss(b: np.ndarray) -> float:
        z = X @ b
        return float(np.average(np.logaddexp(0.0, z) - Y * z, weights=W))

    held, area, inside, preload, failed = minimize(loss, np.zeros(X.shape[1])).x
    return Grade(*(round(float(v), 2) for v in (held, area, inside, -preload, failed)))


def brier(all_trials: list[Trials], told: list[Settled], grade: Grade | None) -> float:
    """Mean squared error of a sample's chance, averaged over parts."""
    errors: dict[str, list[np.ndarray]] = {}
    for trials, settled in zip(all_trials, told, strict=True):
        chance = grade.chances(YUMI, settled) if grade else (settled.margin >= 1.0).astype(float)
        error = (chance - (trials.outcome == Outcome.HELD))[trials.valid] ** 2
        errors.setdefault(trials.object_name, []).append(error)
    return float(np.mean([np.concatenate(each).mean() for each in errors.values()]))


def cross_fitted(all_trials: list[Trials], told: list[Settled]) -> dict[str, Any]:
    """Grades fitted without half of the parts, and their error on that half."""
    names = list(dict.fromkeys(trials.object_name for trials in all_trials))
    result: dict[str, Any] = {}
    for half in (0, 1):
        left_out = set(names[half::2])
        fit, judge = [], []
        for pair in zip(all_trials, told, strict=True):
            (judge if pair[0].object_name in left_out else fit).append(pair)
        grade = fit_grade(*map(list, zip(*fit, strict=True)))  # type: ignore[arg-type]
        judged = list(map(list, zip(*judge, strict=True)))
        result[f"without half {half}"] = {
            "grade": grade.version,
            "brier": brier(*judged, grade),  # type: ignore[arg-type]
            "brier of plain verdicts": brier(*judged, None),  # type: ignore[arg-type]
        }
    return result


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
    scorers = [make_scorer(name) for name in ("settled-robust", "reach-robust", "reach")]
    table = compare(cases, scorers, pose_error=ERROR, seed=1, use_cache=False)
    plain = make_scorer("settled-robust", graded=False)
    shares = np.array(
        [plain.score(c.scene, c.grasp, pose_error=ERROR, seed=1).value for c in cases]
    )
    graded = table.row("settled-robust").scores
    results = {
        "grasps": len(cases),
        "parts": len({case.object_name for case in cases}),
        "trials": int(sum(case.trials for case in cases)),
        "started inside part or table": int(sum((~t.valid).sum() for t in all_trials)),
        "CPU ms a verdict": 1e3 * cost,
        "agreement": agreement(all_trials, told),
        "grade fitted on all": fit_grade(all_trials, told).version,
        "grade": cross_fitted(all_trials, told),
        "table": {row.name: row.mean for row in table.rows},
        "above overlap": {row.name: row.above_overlap for row in table.rows if row.above_overlap},
        "settled-robust, plain share": mean_metrics(Outcomes.of(cases), shares),
        "reliability diagram": reliability_diagram(cases, graded),
        "worst": worst(cases, graded),
    }
    text = json.dumps(results, indent=1)
    print(text)
    if arguments.json is not None:
        arguments.json.write_text(text + "\n")


if __name__ == "__main__":
    main()
