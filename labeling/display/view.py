"""What the consoles show: the state in JSON, without a prediction for what is yet to be labeled."""

from __future__ import annotations

import time
from dataclasses import asdict
from typing import Any, Final

from labeling.display.console import Console, no_recording
from labeling.taxonomy import CAUSE_TEXT, KEYS, REASON_TEXT, RULE
from logs.journal.events import LabelEvent, Outcome, Phase
from logs.journal.state import SessionState, TakeState, TrialState

View = dict[str, Any]
HISTORY_LENGTH: Final = 40
REMEMBERED_COMMANDS: Final = 32


def console_terms() -> View:
    """The words and keys, the same for every session."""
    return {
        "rule": RULE,
        "reasons": [{"value": value, "text": text} for value, text in REASON_TEXT.items()],
        "causes": [{"value": value, "text": text} for value, text in CAUSE_TEXT.items()],
        "keys": KEYS,
    }


def console_view(console: Console) -> View:
    """Everything a console shows at this moment, consistent within itself."""
    controller = console.controller
    with controller.reading() as state:
        return {
            "tick": controller.tick(),
            "version": controller.version,
            "title": console.title,
            "mode": console.mode,
            "operator": console.actor.operator,
            "simulated": console.simulated,
            "practice": console.practice,
            "state": _state(console, state),
            "stopped": state.stopped,
            "paused": state.paused,
            "holds": dict(state.holds),
            "control_rev": state.control_rev,
            "lights": {
                name: {"ok": ok, "text": text} for name, (ok, text) in controller.lights.items()
            },
            "counts": _counts(console, state),
            "of": len(state.trials),
            "disk_left": controller.disk.left,
            "disk_low": controller.disk.low,
            **_verdicts(console, state),
            "elapsed": (time.time_ns() - state.opened_ns) / 1e9 if state.opened_ns else None,
            "recordings": console.recordings is not no_recording,
            "second": console.second,
            "trial": _current(console, state),
            "undoable": _undoable(console, state),
            "recent_commands": list(state.commands)[-REMEMBERED_COMMANDS:],
            "next": _upcoming(state),
        }


def _state(console: Console, state: SessionState) -> str:
    closed = console.controller.closed
    if console.mode == "review":
        return "ENDED" if closed else "REVIEW"
    return overall_state(state, closed=closed)


def _counts(console: Console, state: SessionState) -> View:
    """The session in numbers; to a second operator, their own work in it."""
    counts = {name: value for name, value in asdict(state.counts()).items() if name != "successes"}
    if not console.second:
        return counts
    operator = console.actor.operator
    takes = [take for trial in state.trials.values() if (take := to_judge(trial, operator))]
    done = sum(operator in take.second_labels for take in takes)
    return {**counts, "planned": len(takes), "labelled": done, "unlabelled": len(takes) - done}


def to_judge(trial: TrialState, operator: str) -> TakeState | None:
    """The take of a trial that a second operator may judge: one that somebody else has labeled."""
    take = trial.valid_take
    if take is None or trial.skipped or take.label is None or take.label.operator == operator:
        return None
    return take


def _verdicts(console: Console, state: SessionState) -> View:
    """What was decided so far; nothing of it where it could sway who looks again."""
    if console.mode == "review":
        return {"success": {}, "history": []}
    return {"success": success_by_object(state), "history": _history(state)}


def overall_state(state: SessionState, *, closed: bool = False) -> str:
    """One word for the whole station."""
    if closed or state.closed is not None:
        return "ENDED"
    if state.stopped:
        return "STOPPED"
    trial = state.current_trial
    take = trial.active_take if trial else None
    phase = take.phase if take else None
    if phase is Phase.AWAITING_LABEL and trial is not None and trial.status == "unlabelled":
        return phase.value  # a label is welcome in a pause as well
    if state.holds:
        return "HELD"
    if state.paused:
        return "PAUSED"
    return phase.value if phase else "READY"


def success_by_object(state: SessionState) -> dict[str, list[int]]:
    """Successes and labeled trials per object."""
    table: dict[str, list[int]] = {}
    for trial in state.trials.values():
        label = trial.label
        row = table.setdefault(trial.planned.object_name, [0, 0])
        if label is not None and trial.status == "labelled":
            row[0] += label.outcome is Outcome.SUCCESS
            row[1] += 1
    return table


def trial_view(trial: TrialState, take: TakeState) -> View:
    """A trial as the operator may see it while a decision is due: no prediction, no sensor."""
    planned = trial.planned
    return {
        "trial_id": trial.trial_id,
        "rev": trial.rev,
        "number": planned.number,
        "object": planned.object_name,
        "stable_pose": planned.stable_pose,
        "grasp_id": planned.grasp_id,
        "repeat": planned.repeat,
        "take": take.take,
        "phase": take.phase.value,
        "status": trial.status,
        "placed": take.placed,
        "info": dict(take.info),
        "recovered": take.recovered,
        "again_because": _again_because(trial, take),
    }


def _again_because(trial: TrialState, take: TakeState) -> str:
    """Why the take before this one did not count."""
    earlier = [other for other in trial.takes if other.take < take.take]
    return earlier[-1].ended_because if earlier else ""


def label_view(label: LabelEvent | None) -> View | None:
    """A verdict."""
    if label is None:
        return None
    return {
        "outcome": label.outcome.value,
        "rotated": label.rotated,
        "reason": label.reason.value if label.reason else None,
        "note": label.note,
        "operator": label.operator,
        "source": label.source.value,
    }


def _current(console: Console, state: SessionState) -> View | None:
    trial = state.current_trial
    take = trial.active_take if trial else None
    if console.mode == "review" or trial is None or take is None:
        return None
    return {
        **trial_view(trial, take),
        "pictures": list(console.pictures.names(trial.trial_id, take.take)),
    }


def _undoable(console: Console, state: SessionState) -> View | None:
    since = console.sitting_since
    if console.second:
        found = state.last_second_verdict(console.actor.operator, since)
    else:
        found = state.last_decision(since)
    if found is None:
        return None
    trial, entry = found
    return {
        "trial_id": trial.trial_id,
        "rev": trial.rev,
        "number": trial.planned.number,
        "kind": entry.event.kind,
    }


def _history(state: SessionState) -> list[View]:
    settled = [
        (trial, take)
        for trial in state.trials.values()
        if (
            take := trial.valid_take or (trial.takes[-1] if trial.skipped and trial.takes else None)
        )
    ]
    settled.sort(key=lambda pair: pair[1].executed_ns or 0, reverse=True)
    return [
        _settled(trial, take, scores=state.shows_scores(trial))
        for trial, take in settled[:HISTORY_LENGTH]
    ]


def _settled(trial: TrialState, take: TakeState, *, scores: bool) -> View:
    shown: View = {
        "trial_id": trial.trial_id,
        "rev": trial.rev,
        "number": trial.planned.number,
        "object": trial.planned.object_name,
        "take": take.take,
        "status": trial.status,
        "label": label_view(take.label),
    }
    if scores and trial.status == "labelled":
        shown["scores"] = {model: score.value for model, score in take.scores.items()}
    return shown


def _upcoming(state: SessionState) -> View | None:
    waiting = (trial for trial in state.trials.values() if trial.status == "pending")
    trial = next(waiting, None)
    return {"number": trial.planned.number, "object": trial.planned.object_name} if trial else None
