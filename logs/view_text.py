"""The view's text panel, as Markdown."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from logs.annotations import Annotations, LabelRecord, ScoreRecord
from logs.trial_record import TrialRecord
from logs.view_contacts import PREFERRED, highest_pressure

DISAGREES = 0.5
"""A model predicts success from this score on."""


def summary(record: TrialRecord, annotations: Annotations, *, blind: bool) -> str:
    """What happened and what was predicted; a blind one tells only what was asked for."""
    described = record.descriptor
    take = f", take {described.take}" if described.take > 1 else ""
    parts = [f"# Trial {described.number}: {described.object_name}{take}"]
    if not blind:
        parts += [_verdict(annotations.label), _scores(annotations)]
    parts += [_grasp(record, blind=blind), _registration(record), _origin(record)]
    if record.damage:
        parts.insert(
            1, f"**Damaged record, only its beginning is shown:** {escaped(record.damage)}"
        )
    return "\n\n".join(part for part in parts if part)


def escaped(text: str) -> str:
    """Free text that Markdown shall show as it is."""
    flat = " ".join(text.split())
    for mark in "\\`*_{}[]<>#|":
        flat = flat.replace(mark, f"\\{mark}")
    return flat


def outcome_words(label: LabelRecord | None) -> str:
    """A label in a few words."""
    if label is None:
        return "not labeled"
    reason = label.reason.replace("_", " ")
    turned = "turned in the grasp" if label.details.get("rotated") == "true" else ""
    return ", ".join(word for word in (label.outcome, reason, turned) if word)


def agrees(score: ScoreRecord, label: LabelRecord) -> bool:
    """Whether a prediction and the label name the same outcome."""
    return (score.value >= DISAGREES) == (label.outcome == "success")


def _verdict(label: LabelRecord | None) -> str:
    if label is None:
        return "**Label:** none yet"
    note = f"\n\n> {escaped(label.note)}" if label.note else ""
    who = f" ({escaped(label.operator)})" if label.operator else ""
    return f"**Label: {outcome_words(label)}**{who}{note}"


def _scores(annotations: Annotations) -> str:
    scores = annotations.newest_scores
    if not scores:
        return ""
    scores = dict(sorted(scores.items(), key=lambda item: (item[0] != PREFERRED, item[0])))
    label = annotations.label
    lines = ["## Scores", "| model | predicts | |", "|---|---|---|"]
    for model, score in scores.items():
        mark = "" if label is None else ("agrees" if agrees(score, label) else "**disagrees**")
        lines.append(f"| {escaped(model)} {escaped(score.version)} | {score.value:.2f} | {mark} |")
    for score in scores.values():
        lines += _explained(score)
    return "\n".join(lines)


def _explained(score: ScoreRecord) -> Iterable[str]:
    told = [escaped(score.explanation)] if score.explanation else []
    if score.patches:
        area = sum(patch.area for patch in score.patches) * 1e6
        told.append(f"contact {area:.0f} mm², up to {highest_pressure(score) / 1e3:.0f} kPa")
    told += [f"{escaped(name)} {escaped(value)}" for name, value in score.parameters.items()]
    told += [f"{escaped(name)} {value:.3g}" for name, value in score.details.items()]
    return ["", f"*{escaped(score.model)}:* {'; '.join(told)}"] if told else []


def _grasp(record: TrialRecord, *, blind: bool) -> str:
    planned = record.descriptor.planned
    lines = ["## Grasp", f"- planned: {escaped(record.descriptor.grasp_id)}, {planned.force:g} N"]
    execution = record.execution
    if execution is not None:
        offset = execution.T_world_gripper[:3, 3] - execution.T_world_gripper_commanded[:3, 3]
        lines.append(f"- executed {np.linalg.norm(offset) * 1e3:.2f} mm off the command")
        if not blind:
            lines.append(f"- sensors say: {escaped(execution.sensor_verdict)}")
            for name, value in execution.measurements.items():
                lines.append(f"- {escaped(name)}: {value:.4g}")
    if record.stop is None:
        lines.append("- the record has no end: the process was killed")
    elif record.stop.reason:
        lines.append(f"- ended: {record.stop.exit_status}, {escaped(record.stop.reason)}")
    lines += [f"- gap: {escaped(gap.message)}" for gap in record.gaps]
    return "\n".join(lines)


def _registration(record: TrialRecord) -> str:
    found = record.registration
    if found is None:
        return "## Pose\nnot found"
    spread = np.sqrt(np.diag(found.covariance))
    lines = [
        "## Pose",
        f"- one sigma {np.linalg.norm(spread[3:]) * 1e3:.2f} mm,"
        f" {np.degrees(np.linalg.norm(spread[:3])):.2f}°",
        f"- stable pose {found.stable_pose} (declared {record.descriptor.stable_pose})",
    ]
    if found.ambiguous:
        lines.append("- **ambiguous**")
    if found.contradicts_declared:
        lines.append("- **contradicts the declared pose**")
    if found.unobservable:
        lines.append(f"- not fixed by the image: {escaped(', '.join(found.unobservable))}")
    numbers = ", ".join(f"{escaped(k)} {v:.3g}" for k, v in found.quality.items())
    return "\n".join([*lines, f"- {numbers}"] if numbers else lines)


def _origin(record: TrialRecord) -> str:
    described = record.descriptor
    station = "simulated station" if described.simulated else "real station"
    versions = ", ".join(f"{escaped(k)} {escaped(v)}" for k, v in described.versions.items())
    return (
        f"## Origin\n- {station}, seed {described.seed}\n- trial `{described.trial_id}`\n"
        f"- mass {described.object_mass * 1e3:.1f} g, gripper {escaped(described.gripper_name)}"
        + (f"\n- {versions}" if versions else "")
    )
