"""The data card: what a person should know before using the data, in Markdown."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping
from importlib import resources
from typing import Any

from logs.dataset.dataset import Dataset
from logs.dataset.manifest import FRAMES, UNITS
from logs.export.columns import columns, scored_models
from logs.footnotes import ORACLE, footnotes

CARD_NAME = "README.md"
_CONTENTS: Mapping[str, str] = {
    "trials.parquet": "the trial table; units and meanings are the columns' metadata",
    "trials.csv": "the same table as text; lists are JSON",
    "meshes": "object surfaces, meters, object frame; binary PLY with double precision",
    "graspgen": "GraspGen JSON, one file an object",
    "isaac_grasp": "isaac_grasp YAML 1.0, one file an object",
    "acronym": "ACRONYM HDF5, one file an object",
    "reach2019": "the form of the data published in 2019, one file an object",
    "croissant.json": "Croissant 1.0 description of the trial table",
    "source_records.jsonl": "the imported records, word for word",
}


def card_bytes(dataset: Dataset, paths: Iterable[str]) -> bytes:
    """The card of a data set whose folder holds these paths."""
    from jinja2 import Environment, StrictUndefined

    template = resources.files("logs.export").joinpath("card.md").read_text(encoding="utf-8")
    environment = Environment(
        undefined=StrictUndefined, keep_trailing_newline=True, autoescape=False
    )
    text = environment.from_string(template).render(**_facts(dataset, list(paths)))
    return (text.rstrip() + "\n").encode()


def _facts(dataset: Dataset, paths: list[str]) -> dict[str, Any]:
    trials = dataset.trials
    tops = dict.fromkeys(path.split("/")[0] for path in sorted(paths))
    tabular = any(name.startswith("trials.") for name in tops)
    return {
        "dataset": dataset,
        "simulated": sum(trial.simulated for trial in trials),
        "grasps": len(dataset.by_grasp()),
        "percent": _percent,
        "left_out": _counted(row.reason for row in dataset.left_out),
        "redone": sum(len(trial.redos) for trial in trials),
        "voided": sum(len(trial.voids) for trial in trials),
        "relabeled": sum(trial.label.relabeled > 0 for trial in trials),
        "unblinded": sum(not trial.label.blind for trial in trials),
        "sources": _counted(trial.label.source for trial in trials),
        "objects": _objects(dataset),
        "reasons": _counted(
            trial.label.reason or "not said" for trial in trials if not trial.label.success
        ),
        "units": UNITS,
        "frames": FRAMES,
        "files": [(name, _CONTENTS[name]) for name in tops if name in _CONTENTS],
        "columns": columns(scored_models(trials)) if tabular else (),
        "caveats": _caveats(dataset, tops),
    }


def _objects(dataset: Dataset) -> list[dict[str, Any]]:
    return [
        {
            "name": name,
            "mass": dataset.objects[name].mass,
            "source": dataset.mass_sources.get(name, "not stated"),
            "grasps": len({trial.grasp_id for trial in trials}),
            "trials": len(trials),
            "successes": sum(trial.label.success for trial in trials),
        }
        for name, trials in dataset.by_object().items()
    ]


def _caveats(dataset: Dataset, tops: Iterable[str]) -> list[str]:
    caveats = list(dataset.notes)
    if dataset.simulated:
        caveats.append("Simulated outcomes show what the simulation believes, not what happens.")
    scored = scored_models(dataset.trials)
    caveats += [
        f"Scores of {', '.join(names)}: {note}."
        for note, names in footnotes(scored, simulated=dataset.simulated).items()
    ]
    caveats.append(f"To compare models: {ORACLE}.")
    if {"graspgen", "acronym", "isaac_grasp"} & set(tops):
        caveats.append(
            "GraspGen and ACRONYM files hold one entry a planned grasp: `object_in_gripper` is the "
            "majority of its trials, a tie counts as failed; the success rate stands beside it. "
            "Widths are the jaws' mean measured width in successful trials, else the mesh's."
        )
    if "acronym" in tops:
        caveats.append("ACRONYM's motions and friction were not measured: they are NaN.")
    if "reach2019" in tops and any(trial.source_record is None for trial in dataset.trials):
        caveats.append(
            "In reach2019 files written from recorded sessions, `tf` carries the planned to the "
            "registered pose in the world, and the published models' `qs_*` predictions are absent."
        )
    if any(trial.execution.covariance_in_hand is not None for trial in dataset.trials):
        caveats.append(
            "Errors of calibration and hand are common to all trials under one set-up (a segment of "
            "a session): every trial is shifted alike. A robust score draws them anew in each of "
            "its samples, so that it is a chance over stations of this kind, and a session's labels "
            "may lie to one side of it together."
        )
    if dataset.pose_error is None:
        caveats.append("No pose error is stated: pass --pose-error to `reach evaluate`.")
    caveats.append("Trials of one grasp are repeats, not independent samples of all grasps.")
    return caveats


def _counted(values: Iterable[str]) -> list[tuple[str, int]]:
    """Values with their counts, most frequent first, then by name."""
    return sorted(Counter(values).items(), key=lambda item: (-item[1], item[0]))


def _percent(part: int, whole: int) -> str:
    return f"{100 * part / whole:.0f} %" if whole else "none"
