"""Which command is allowed when, and which event it becomes.

Pure functions of the folded state: the controller adds the lock, the disk, and the answer.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Final, cast

from labeling.control import commands as cm
from labeling.control.commands import Actor, Command, CommandKind, Value
from labeling.errors import LabelingError
from logs.journal import events as ev
from logs.journal.events import AnyEvent, Phase
from logs.journal.state import SessionState, TakeState, TrialState


class RefusedError(LabelingError):
    """The command makes no sense in this state; the message is for the operator."""


Fields = dict[str, object]

TRIAL_KINDS: Final = frozenset(CommandKind) - {
    CommandKind.NOTE,
    CommandKind.PAUSE,
    CommandKind.RESUME,
    CommandKind.STOP,
    CommandKind.CLEAR_STOP,
}
NEEDS_REVISION: Final = TRIAL_KINDS | {CommandKind.RESUME, CommandKind.CLEAR_STOP}
ALLOWED_WHILE_STOPPED: Final = {CommandKind.STOP, CommandKind.CLEAR_STOP, CommandKind.NOTE}


def event_of(
    state: SessionState, command: Command, value: Value, actor: Actor, *, blind: bool
) -> AnyEvent:
    """The event that a command becomes in this state.

    Args:
        state: what the journal adds up to.
        command: already known to be neither a duplicate nor stale.
        value: the command's value, validated.
        actor: who sent it.
        blind: the sender has seen no prediction for the trial.

    Raises:
        RefusedError: if the command is not allowed now.
    """
    if state.stopped and command.kind not in ALLOWED_WHILE_STOPPED:
        raise RefusedError("the station is stopped; clear the stop first")
    who: Fields = {"operator": actor.operator, "source": actor.source, "command_id": command.id}
    if command.kind not in TRIAL_KINDS:
        return _control_event(state, command, value, who)
    trial = state.trials[cast(str, command.trial_id)]
    return _TRIAL_RULES[command.kind](
        state, trial, value, {**who, "trial_id": trial.trial_id}, blind
    )


def _make(kind: type[ev.EventBase], fields: Fields, **more: object) -> AnyEvent:
    return cast(AnyEvent, kind.model_validate({**fields, **more}))


def _control_event(state: SessionState, command: Command, value: Value, who: Fields) -> AnyEvent:
    match command.kind, value:
        case CommandKind.PAUSE, _:
            if state.paused:
                raise RefusedError("the session is paused already")
            return _make(ev.Paused, who)
        case CommandKind.RESUME, _:
            if not state.paused:
                raise RefusedError("the session is not paused")
            return _make(ev.Resumed, who)
        case CommandKind.STOP, cm.NoteValue(text=text):
            return _make(ev.Stopped, who, reason=text)
        case CommandKind.CLEAR_STOP, _:
            if not state.stopped:
                raise RefusedError("the station is not stopped")
            return _make(ev.StopCleared, who)
        case CommandKind.NOTE, cm.NoteValue(text=text) if text.strip():
            return _make(ev.Noted, who, trial_id=command.trial_id, text=text)
    raise RefusedError("a note needs a text")


def _running_take(state: SessionState, trial: TrialState, *phases: Phase) -> TakeState:
    take = trial.takes[-1] if trial.takes else None
    if state.current != trial.trial_id or take is None or take.status != "running":
        raise RefusedError(f"trial {trial.planned.number} is not under way")
    if take.phase not in phases:
        wanted = " or ".join(phase.value for phase in phases)
        raise RefusedError(f"the trial is in {take.phase.value}, not in {wanted}")
    return take


def _executed_take(trial: TrialState) -> TakeState:
    take = trial.valid_take
    if take is None or trial.skipped:
        raise RefusedError(f"trial {trial.planned.number} has no executed take to decide about")
    return take


def _take_at_rest(trial: TrialState) -> TakeState:
    """The take under way, unless the robot moves in it; else the one that was executed."""
    _not_moving(trial)
    take = trial.active_take
    return take if take is not None and take.status == "running" else _executed_take(trial)


def _not_moving(trial: TrialState) -> None:
    take = trial.takes[-1] if trial.takes else None
    if take is not None and take.status == "running" and take.phase is Phase.EXECUTE:
        raise RefusedError("the robot is executing; wait for it, or press stop")


def _placed(state: SessionState, trial: TrialState, value: Value, who: Fields, _: bool) -> AnyEvent:
    take = _running_take(state, trial, Phase.PLACE_OBJECT)
    if state.paused or state.holds:
        raise RefusedError("the session is paused; resume it first")
    return _make(ev.Placed, who, take=take.take)


def _accept_pose(
    state: SessionState, trial: TrialState, value: Value, who: Fields, _: bool
) -> AnyEvent:
    take = _running_take(state, trial, Phase.CONFIRM_POSE)
    rival = cast(cm.RivalValue, value).rival
    rivals = take.info.get("rivals", ())
    count = len(rivals) if isinstance(rivals, (list, tuple)) else 0
    if rival > count:
        raise RefusedError(f"there is no pose {rival}; valid: 0 to {count}")
    return _make(ev.PoseAccepted, who, take=take.take, rival=rival)


def _replace_object(
    state: SessionState, trial: TrialState, value: Value, who: Fields, _: bool
) -> AnyEvent:
    take = _running_take(state, trial, Phase.CONFIRM_POSE)
    return _make(ev.ObjectReplaced, who, take=take.take)


def _label(
    state: SessionState, trial: TrialState, value: Value, who: Fields, blind: bool
) -> AnyEvent:
    take = trial.active_take
    awaiting = (
        state.current == trial.trial_id
        and take is not None
        and take.status == "executed"
        and take.phase is Phase.AWAITING_LABEL
    )
    if take is None or not awaiting:
        raise RefusedError("a label is taken only after the robot has executed the trial")
    if take.label is not None:
        raise RefusedError("this trial is labeled already; relabel it, or undo the label")
    return _make(ev.Labelled, who, take=take.take, blind=blind, **value.model_dump())


def _relabel(
    state: SessionState, trial: TrialState, value: Value, who: Fields, blind: bool
) -> AnyEvent:
    take = _executed_take(trial)
    return _make(ev.Relabelled, who, take=take.take, blind=blind, **value.model_dump())


def _second_label(
    state: SessionState, trial: TrialState, value: Value, who: Fields, blind: bool
) -> AnyEvent:
    take = _executed_take(trial)
    if take.label is None:
        raise RefusedError("a second label needs a first one")
    if take.label.operator == who["operator"]:
        raise RefusedError("a second label must come from another operator")
    return _make(ev.SecondLabelled, who, take=take.take, blind=blind, **value.model_dump())


def _undo(state: SessionState, trial: TrialState, value: Value, who: Fields, _: bool) -> AnyEvent:
    if not trial.decisions:
        raise RefusedError(f"there is nothing to undo in trial {trial.planned.number}")
    newest = trial.decisions[-1]
    if isinstance(newest.event, (ev.Redone, ev.Voided)):
        take = trial.takes[-1]
        if take.status == "running" and take.phase is not Phase.PLACE_OBJECT:
            raise RefusedError(
                "the next take has begun; it can be redone, the old one not restored"
            )
    return _make(ev.Undone, who, undoes=newest.seq)


def _undo_second(
    state: SessionState, trial: TrialState, value: Value, who: Fields, _: bool
) -> AnyEvent:
    take = trial.valid_take
    own = take.second_entry(cast(str, who["operator"])) if take else None
    if own is None:
        raise RefusedError(f"you have given trial {trial.planned.number} no second label")
    return _make(ev.Undone, who, undoes=own.seq)


def _redo(state: SessionState, trial: TrialState, value: Value, who: Fields, _: bool) -> AnyEvent:
    take = _take_at_rest(trial)
    return _make(ev.Redone, who, take=take.take, **value.model_dump())


def _void(state: SessionState, trial: TrialState, value: Value, who: Fields, _: bool) -> AnyEvent:
    take = _take_at_rest(trial)
    return _make(ev.Voided, who, take=take.take, **value.model_dump())


def _skip(state: SessionState, trial: TrialState, value: Value, who: Fields, _: bool) -> AnyEvent:
    _not_moving(trial)
    if trial.skipped:
        raise RefusedError(f"trial {trial.planned.number} is skipped already")
    return _make(ev.Skipped, who, note=cast(cm.NoteValue, value).text)


_TRIAL_RULES: Final[
    dict[CommandKind, Callable[[SessionState, TrialState, Value, Fields, bool], AnyEvent]]
] = {
    CommandKind.PLACED: _placed,
    CommandKind.ACCEPT_POSE: _accept_pose,
    CommandKind.REPLACE_OBJECT: _replace_object,
    CommandKind.LABEL: _label,
    CommandKind.RELABEL: _relabel,
    CommandKind.SECOND_LABEL: _second_label,
    CommandKind.UNDO: _undo,
    CommandKind.UNDO_SECOND: _undo_second,
    CommandKind.REDO: _redo,
    CommandKind.VOID: _void,
    CommandKind.SKIP: _skip,
}
