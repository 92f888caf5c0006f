"""What becomes of a command: an event to be stored, or the answer that says why not.

Pure functions of the folded state and the time: the controller adds the lock and the disk.
"""

from __future__ import annotations

from typing import Final

from pydantic import ValidationError

from labeling.control.commands import (
    VALUE_MODELS,
    Actor,
    Answer,
    AnswerStatus,
    Command,
    CommandKind,
    Value,
)
from labeling.control.rules import NEEDS_REVISION, TRIAL_KINDS, RefusedError, event_of
from logs.journal.events import AnyEvent
from logs.journal.state import SessionState

COMMAND_AGE_LIMIT: Final = 2.0
"""Seconds after which a command is refused: a thawed server finds old ones in its sockets."""


def judge(
    state: SessionState, command: Command, actor: Actor, *, now: float, closed: bool
) -> AnyEvent | Answer:
    """The event that a command becomes, or the answer if it becomes none.

    Args:
        state: what the journal adds up to.
        command: what is asked for.
        actor: who asks.
        now: the clock of the commands' ticks [s].
        closed: the session's writer has ended.
    """
    known = state.commands.get(command.id)
    # A stop that is sent again has stopped the robot again: it stands until it is cleared.
    stops_again = command.kind is CommandKind.STOP and not state.stopped
    if known is not None and not stops_again:
        rev = revision(state, command)
        return Answer(status=AnswerStatus.DUPLICATE, rev=rev, seq=known.seq)
    if closed:
        return rejection(state, command, "the session has ended")
    if command.kind in TRIAL_KINDS and command.trial_id not in state.trials:
        return rejection(state, command, f"no trial {command.trial_id!r} here")
    why_stale = _staleness(state, command, now)
    if why_stale:
        return _no(state, command, AnswerStatus.STALE, why_stale)
    try:
        value = VALUE_MODELS[command.kind].model_validate(command.value)
        return event_of(state, command, value, actor, blind=_is_blind(state, command, value, actor))
    except ValidationError as error:
        return rejection(state, command, _first_problem(error))
    except RefusedError as error:
        return rejection(state, command, str(error))


def rejection(state: SessionState, command: Command, why: str) -> Answer:
    """The answer to a command that is not stored."""
    return _no(state, command, AnswerStatus.REJECTED, why)


def revision(state: SessionState, command: Command) -> int:
    """The revision a command is about: its trial's, else the session's."""
    trial = state.trials.get(command.trial_id or "")
    return trial.rev if trial and command.kind in TRIAL_KINDS else state.control_rev


def _staleness(state: SessionState, command: Command, now: float) -> str:
    if command.kind is CommandKind.STOP:
        return ""
    # A tick of the future, or none at all (nan), is nothing this server ever said.
    if command.tick is not None and not 0 <= now - command.tick <= COMMAND_AGE_LIMIT:
        return f"the command is older than {COMMAND_AGE_LIMIT:g} s"
    if command.kind in NEEDS_REVISION and command.rev != revision(state, command):
        return "something changed since this was on the screen; look again"
    return ""


def _is_blind(state: SessionState, command: Command, value: Value, actor: Actor) -> bool:
    if getattr(value, "found_by", None) == "disagreement":
        return False
    trial = state.trials.get(command.trial_id or "")
    return trial is None or actor.operator not in state.shown_to(trial)


def _no(state: SessionState, command: Command, status: AnswerStatus, message: str) -> Answer:
    return Answer(status=status, rev=revision(state, command), message=message)


def _first_problem(error: ValidationError) -> str:
    problem = error.errors()[0]
    where = ".".join(map(str, problem["loc"]))
    message = str(problem["msg"]).removeprefix("Value error, ")
    return f"{where}: {message}" if where else message
