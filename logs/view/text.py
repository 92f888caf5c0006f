"""The view's text panel, as Markdown."""

from __future__ import annotations

import json

import numpy as np

from logs.prediction import predicts_success
from logs.record.annotations import Annotations, LabelRecord, ScoreRecord
from logs.record.trial_record import TrialRecord
from logs.view.contacts import brightest_pressure, highest_pressure
from reach.models.names import PATCH_MODEL
from reach.pose_error import PoseError


def summary(record: TrialRecord, annotations: Annotations, *, blind: bool) -> str:
    """What happened and what was predicted; a blind one tells only what was asked for."""
    described = record.descriptor
    take = f", take {described.take}" if described.take > 1 else ""
    parts = [f"### Trial {described.number}: {described.object_name}{take}"]
    if record.damage:
        parts.append(f"**Damaged record, only its beginning is shown:** {escaped(record.damage)}")
    if not blind:
        parts += [_verdict(annotations.label), _scores(annotations)]
    parts += [_grasp(record, blind=blind), _registration(record), _origin(record)]
    if not blind:
        parts.append(_models(annotations))
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
    return predicts_success(score.value) == (label.outcome == "success")


def _verdict(label: LabelRecord | None) -> str:
    if label is None:
        return "**Label:** none yet"
    note = f"\n\n> {escaped(label.note)}" if label.note else ""
    who = f" ({escaped(label.operator)})" if label.operator else ""
    return f"**Label: {outcome_words(label)}**{who}{note}"


def _scores(annotations: Annotations) -> str:
    scores = _ordered(annotations)
    if not scores:
        return ""
    label = annotations.label
    lines = ["| model | predicts | |", "|---|---|---|"]
    for score in scores:
        mark = "" if label is None else ("agrees" if agrees(score, label) else "**disagrees**")
        lines.append(f"| {escaped(score.model)} | {score.value:.2f} | {mark} |")
    told = [f"- *{escaped(s.model)}:* {'; '.join(words)}" for s in scores if (words := _said(s))]
    return "\n".join([*lines, "", *told])


def _ordered(annotations: Annotations) -> list[ScoreRecord]:
    """Newest scores, that of the model whose contacts are shown first."""
    scores = annotations.newest_scores.values()
    return sorted(scores, key=lambda score: (score.model != PATCH_MODEL, score.model))


def _said(score: ScoreRecord) -> list[str]:
    """What a model gives as its reason."""
    told = [score.explanation] if score.explanation else []
    try:
        longer = json.loads(score.texts.get("explanation", '""'))
    except ValueError:
        longer = ""
    if isinstance(longer, str) and longer:
        told = [longer]
    if score.patches:
        area = sum(patch.area for patch in score.patches) * 1e6
        peak, bright = highest_pressure(score) / 1e3, brightest_pressure(score) / 1e3
        told.append(f"contact {area:.0f} mm², up to {peak:.0f} kPa (yellow from {bright:.0f})")
    return [escaped(text) for text in told]


def _models(annotations: Annotations) -> str:
    """With which parameters the models were asked, and the numbers they gave."""
    lines = []
    for score in _ordered(annotations):
        numbers = [f"{escaped(name)} {value:.3g}" for name, value in sorted(score.details.items())]
        numbers += [f"{escaped(k)} {escaped(v)}" for k, v in sorted(score.parameters.items())]
        name = f"{escaped(score.model)}, version {escaped(score.version)}"
        lines.append(f"- *{name}:* {', '.join(numbers)}")
    return "\n".join(["**Models**", "", *lines]) if lines else ""


def _grasp(record: TrialRecord, *, blind: bool) -> str:
    planned = record.descriptor.planned
    lines = [
        "**Grasp**",
        "",
        f"- planned: {escaped(record.descriptor.grasp_id)}, {planned.force:g} N",
    ]
    execution = record.execution
    if execution is not None:
        offset = execution.T_world_gripper[:3, 3] - execution.T_world_gripper_commanded[:3, 3]
        lines.append(f"- executed {np.linalg.norm(offset) * 1e3:.2f} mm off the command")
        if not blind:
            lines.append(f"- sensors say: {escaped(execution.sensor_verdict)}")
            for name, value in execution.measurements.items():
                lines.append(f"- {escaped(name.replace('_', ' '))}: {_measured(name, value)}")
    if record.stop is None:
        lines.append("- the record has no end: the process was killed")
    elif record.stop.reason:
        lines.append(f"- ended: {record.stop.exit_status}, {escaped(record.stop.reason)}")
    lines += [f"- gap: {escaped(gap.message)}" for gap in record.gaps]
    return "\n".join(lines)


def _measured(name: str, value: float) -> str:
    """A number with its unit, if the record's conventions fix one."""
    if name.startswith("width"):
        return f"{value * 1e3:.2f} mm"
    return f"{value:.1f} N" if name == "force" else f"{value:.4g}"


def _registration(record: TrialRecord) -> str:
    found = record.registration
    if found is None:
        return "**Pose:** not found"
    spread = np.sqrt(np.diag(PoseError(found.covariance).without_free_turns().covariance))
    lines = [
        "**Pose**",
        "",
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
        f"**Origin**\n\n- {station}, seed {described.seed}\n- trial `{described.trial_id}`\n"
        f"- mass {described.object_mass * 1e3:.1f} g, gripper {escaped(described.gripper_name)}"
        + (f"\n- {versions}" if versions else "")
    )
