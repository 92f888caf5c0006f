"""The settled model against the pin world: agreement, ranking, calibration, and cost.

    python benchmarks/settled_trials.py            # simulate, can be stopped and taken up again
    python benchmarks/settled.py [--json OUT] [--errors wide] [--meshes DIR]

Verdicts are compared trial by trial, on the same perturbed pose, friction and mass. Scores are
compared grasp by grasp, under each pose error; a score draws perturbations of its own. On the
built-in parts the grade is fitted on half of the parts, on the trials under all errors together,
and judged on the other half, both ways; other parts are judged by the grade as it is shipped.
"""

from __future__ import annotations

import argparse
import json
import time
from pathlib import Path
from typing import Any

import numpy as np
from settled_fit import Known, cross_fitted, fit_grade, judged
from settled_trials import ERRORS, YUMI, Trials, add_options, chosen_runs

from reach.evaluation.cases import GraspCase
from reach.evaluation.compare import compare
from reach.kernels.pads import pads_of
from reach.kernels.tree import mesh_tree
from reach.models.area import AreaContact
from reach.models.base import check_batch
from reach.models.registry import make_scorer
from reach.models.settled import Settled, SettledContact
from reach.models.settled_score import settled_robust
from reach.models.settled_verdict import FATES
from reach.pose_error import PoseError
from reach.world.rollouts import Outcome

SCORE_SEED = 1
MODELS = ("settled-robust", "settled", "reach-robust", "reach")


def settled_trials(trials: Trials, model: SettledContact) -> Settled:
    batch = check_batch(
        trials.scene,
        trials.T_object_gripper,
        force=trials.grasp.force,
        friction=trials.friction,
        mass=trials.mass,
    )
    return model.settle(mesh_tree(trials.scene.object), pads_of(YUMI), batch)


def agreement(all_trials: list[Trials]) -> dict[str, Any]:
    """Share of trials on which a verdict and the pin world agree, by part and by fate."""
    rows: dict[str, list[np.ndarray]] = {}
    model, cpu = SettledContact(), 0.0
    settled_trials(all_trials[0], model)
    for trials in all_trials:
        start = time.process_time()
        settled = settled_trials(trials, model)
        cpu += time.process_time() - start
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
        "CPU ms a verdict": 1e3 * cpu / sum(len(trials.outcome) for trials in all_trials),
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


def cases_of(all_trials: list[Trials]) -> list[GraspCase]:
    return [
        GraspCase(
            trials.object_name,
            trials.grasp_id,
            trials.scene,
            trials.grasp,
            int((trials.outcome == Outcome.HELD)[trials.valid].sum()),
            int(trials.valid.sum()),
        )
        for trials in all_trials
        if trials.valid.any()
    ]


def settled_samples(cases: list[GraspCase], error: PoseError) -> list[Settled]:
    """What `settled-robust` knows of each grasp."""
    robust = settled_robust()
    return [robust.settled_samples(c.scene, c.grasp, error, SCORE_SEED) for c in cases]


def rows_of(cases: list[GraspCase], error: PoseError) -> dict[str, Any]:
    """Models as shipped, and the reference rows."""
    scorers = [make_scorer(name) for name in MODELS]
    table = compare(cases, scorers, pose_error=error, seed=SCORE_SEED, use_cache=False)
    return {
        row.name: {
            **judged(cases, row.scores),
            "above overlap": row.above_overlap,
            "seconds a grasp": row.seconds_per_grasp,
            "worst": worst(cases, row.scores),
        }
        for row in table.rows
    }


def worst(cases: list[GraspCase], scores: np.ndarray, count: int = 10) -> list[list[Any]]:
    rates = np.array([case.rate for case in cases])
    order = np.argsort(-np.abs(scores - rates))[:count]
    return [[cases[i].grasp_id, round(float(scores[i]), 3), round(cases[i].rate, 3)] for i in order]


def fits(known: dict[str, Known]) -> dict[str, Any]:
    """The grade fitted on all parts and on halves of them, and what it gives on the other half."""
    cases = [case for each, _ in known.values() for case in each]
    samples = [settled for _, each in known.values() for settled in each]
    grades, scores = cross_fitted(known)
    return {
        "on all parts": fit_grade(cases, samples).version,
        **grades,
        "on the other half": {
            error: judged(known[error][0], values) for error, values in scores.items()
        },
    }


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--json", type=Path)
    add_options(parser)
    arguments = parser.parse_args()
    results: dict[str, Any] = {}
    known: dict[str, Known] = {}
    for run in chosen_runs(arguments):
        all_trials, error = list(run.trials()), ERRORS[run.error]
        cases = cases_of(all_trials)
        known[run.error] = cases, settled_samples(cases, error)
        results[run.error] = {
            "grasps": len(cases),
            "parts": len({case.object_name for case in cases}),
            "trials": int(sum(case.trials for case in cases)),
            "started inside part or table": int(sum((~t.valid).sum() for t in all_trials)),
            "agreement": agreement(all_trials),
            "rows": rows_of(cases, error),
        }
    if arguments.meshes is None:
        results["grade"] = fits(known)
    text = json.dumps(results, indent=1)
    print(text)
    if arguments.json is not None:
        arguments.json.write_text(text + "\n")


if __name__ == "__main__":
    main()
