"""The report: one HTML page that needs nothing else, pictures first."""

from __future__ import annotations

from importlib import resources
from typing import TYPE_CHECKING, Any

import numpy as np

from logs.footnotes import ORACLE, footnotes, shared_with_engine
from logs.numbers import span
from logs.report import sections
from logs.report.coverage import PlanCoverage, coverage_svg
from logs.report.curves import precision_recall_svg, reliability_svg
from logs.report.drift import drift_svg, measure_drift
from logs.report.pressure import compare_pressure, pressure_svg
from logs.report.reliability_map import ReliabilityPaint, probe_grasps, reliabilities
from logs.report.rendering import data_uri, object_solid, render
from reach.evaluation.bootstrap import interval_note
from reach.evaluation.table import Evaluation

if TYPE_CHECKING:
    from logs.dataset.dataset import Dataset
    from logs.report.agreement import OperatorAgreement
    from reach.evaluation.cases import GraspCase
    from reach.pose_error import PoseError

PROBES = 280
MAP_SIZE = (520, 420)


def build_report(
    dataset: Dataset,
    result: Evaluation,
    pose_error: PoseError,
    *,
    basis: str,
    seed: int = 0,
    covered: PlanCoverage | None = None,
    agreement: OperatorAgreement | None = None,
) -> str:
    """Make the page.

    Args:
        dataset: the labeled trials.
        result: how the models judge their grasps.
        pose_error: that the robust scores were computed under.
        basis: where the pose error is from.
        seed: of the probe grasps.
        covered: what the plan covers, where a plan is known.
        agreement: of two operators, where a second one judged.

    Returns:
        The HTML text; it holds all pictures and styles and loads nothing.
    """
    from jinja2 import Environment, StrictUndefined

    environment = Environment(undefined=StrictUndefined, autoescape=True, trim_blocks=True)
    environment.filters["span"] = span
    text = resources.files("logs.report").joinpath("report.html").read_text(encoding="utf-8")
    drift = measure_drift(dataset)
    names = [row.name for row in result.rows]
    example = _example_case(result)
    pressure = compare_pressure(example) if example else None
    return environment.from_string(text).render(
        dataset=dataset,
        facts=_facts(dataset, result),
        gallery=sections.gallery(dataset),
        table=sections.comparison(result),
        without_positive=result.outcomes.without_positive,
        pr=precision_recall_svg(result),
        calibration=reliability_svg(result),
        maps=_maps(dataset, result, pose_error, seed),
        example=example,
        pressure=pressure,
        pressure_picture=pressure_svg(pressure) if pressure else None,
        worst=sections.disagreements(result),
        station=sections.station(dataset),
        covered=covered,
        coverage_picture=coverage_svg(covered) if covered else None,
        agreement=agreement,
        gains=result.gains,
        interval_note=interval_note(result.outcomes),
        notes=footnotes(names, simulated=dataset.simulated),
        shared=shared_with_engine(names, simulated=dataset.simulated),
        oracle=ORACLE,
        drift=drift,
        drift_picture=drift_svg(drift) if drift else None,
        error={
            "translation": pose_error.translation_deviation * 1e3,
            "rotation": float(np.degrees(pose_error.rotation_deviation)),
            "basis": basis,
        },
    )


def _facts(dataset: Dataset, result: Evaluation) -> dict[str, Any]:
    trials = dataset.trials
    return {
        "trials": len(trials),
        "simulated": sum(trial.simulated for trial in trials),
        "successes": dataset.successes,
        "share": dataset.successes / len(trials),
        "objects": len(dataset.by_object()),
        "grasps": len(result.cases),
        "sessions": len({trial.session for trial in trials}),
    }


def _example_case(result: Evaluation) -> GraspCase | None:
    """The grasp whose patch is shown: held in the trials and by the model, of large overlap."""
    model, overlap = sections.preferred(result).scores, result.row("overlap").scores
    rated = [(case.rate * model[i], overlap[i], i) for i, case in enumerate(result.cases)]
    return result.cases[max(rated)[2]] if rated else None


def _maps(
    dataset: Dataset, result: Evaluation, pose_error: PoseError, seed: int
) -> dict[str, Any] | None:
    """One object colored by reliability under point contact and under REACH (Fig. 1)."""
    from reach.models.area import AreaContact
    from reach.models.point import PointContact

    case = _telling_case(result)
    part, T = dataset.objects[case.object_name], case.scene.T_world_object
    down = T[:3, :3].T @ np.array([0.0, 0.0, -1.0])
    probes = probe_grasps(part, dataset.gripper, down, PROBES, np.random.default_rng(seed))
    if not len(probes.contacts):
        return None
    pictures = []
    for title, model in (("Soft point contact", PointContact()), ("REACH", AreaContact())):
        values = reliabilities(model, part, dataset.gripper, T, probes, pose_error, seed=seed)
        solid = object_solid(part, T, ReliabilityPaint(probes, values))
        pictures.append(
            {
                "title": title,
                "picture": data_uri(render([solid], MAP_SIZE)),
                "mean": float(values.mean()),
            }
        )
    mine = next(one for one in result.outcomes.objects if one.name == part.name)
    return {
        "object": part.name,
        "pictures": pictures,
        "probes": len(probes.contacts),
        "share": float(mine.successes.sum() / mine.trials.sum()),
    }


def _telling_case(result: Evaluation) -> GraspCase:
    """A grasp on the object whose trials say most: lifted closest to every other time."""
    shares = {
        one.name: float(one.successes.sum() / one.trials.sum()) for one in result.outcomes.objects
    }
    return min(result.cases, key=lambda case: abs(shares[case.object_name] - 0.5))
