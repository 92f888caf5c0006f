"""What an operator may ask for, and what is answered.

A command carries what its sender *saw*: the trial and its revision. Its answer says what
became of it; `stored` is given only after the event is on the disk.
"""

from __future__ import annotations

import uuid
from dataclasses import dataclass
from enum import StrEnum
from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field, JsonValue

from logs.journal.events import FailureReason, Outcome, RedoCause, Source


class CommandKind(StrEnum):
    """Everything an operator may ask for."""

    PLACED = "placed"
    ACCEPT_POSE = "accept_pose"
    REPLACE_OBJECT = "replace_object"
    LABEL = "label"
    RELABEL = "relabel"
    SECOND_LABEL = "second_label"
    UNDO = "undo"
    UNDO_SECOND = "undo_second"
    REDO = "redo"
    VOID = "void"
    SKIP = "skip"
    NOTE = "note"
    PAUSE = "pause"
    RESUME = "resume"
    STOP = "stop"
    CLEAR_STOP = "clear_stop"


class Value(BaseModel):
    """Base of what the kinds carry."""

    model_config = ConfigDict(extra="forbid", frozen=True)


class Nothing(Value):
    """No value."""


class RivalValue(Value):
    """Which pose is the right one: 0 is the best, 1, 2, ... its rivals."""

    rival: int = Field(default=0, ge=0)


class LabelValue(Value):
    """A verdict on a take."""

    outcome: Outcome
    rotated: bool = False
    reason: FailureReason | None = None
    note: Annotated[str, Field(max_length=2000)] = ""


class RelabelValue(LabelValue):
    """A later verdict; `found_by` names the filter through which the trial was found."""

    found_by: str | None = None


class RedoValue(Value):
    """Why the take does not count."""

    cause: RedoCause
    note: Annotated[str, Field(max_length=2000)] = ""


class ReasonValue(Value):
    """Why, in the operator's words."""

    reason: Annotated[str, Field(min_length=1, max_length=2000)]


class NoteValue(Value):
    """A remark, possibly empty where it only accompanies a decision."""

    text: Annotated[str, Field(max_length=2000)] = ""


class ConfirmValue(Value):
    """A second, deliberate step."""

    confirm: Literal[True]


VALUE_MODELS: dict[CommandKind, type[Value]] = {
    CommandKind.PLACED: Nothing,
    CommandKind.ACCEPT_POSE: RivalValue,
    CommandKind.REPLACE_OBJECT: Nothing,
    CommandKind.LABEL: LabelValue,
    CommandKind.RELABEL: RelabelValue,
    CommandKind.SECOND_LABEL: LabelValue,
    CommandKind.UNDO: Nothing,
    CommandKind.UNDO_SECOND: Nothing,
    CommandKind.REDO: RedoValue,
    CommandKind.VOID: ReasonValue,
    CommandKind.SKIP: NoteValue,
    CommandKind.NOTE: NoteValue,
    CommandKind.PAUSE: Nothing,
    CommandKind.RESUME: Nothing,
    CommandKind.STOP: NoteValue,
    CommandKind.CLEAR_STOP: ConfirmValue,
}


class Command(BaseModel):
    """One request of an operator.

    Args:
        kind: what is asked for.
        trial_id: the trial it is about; None for the session as a whole.
        rev: the trial's revision the sender saw (for the session: the control revision).
        value: depends on the kind, see `VALUE_MODELS`.
        id: unique; the same id is acted upon once, also across a restart.
        t_client: the sender's clock [s]; kept for nothing but the sender's own use.
        tick: the newest tick the sender got from the server's stream [s]; its age tells how
            long the command was under way. None within the process.
    """

    model_config = ConfigDict(extra="forbid", frozen=True)

    kind: CommandKind
    trial_id: str | None = None
    rev: int | None = None
    value: dict[str, JsonValue] = {}
    id: Annotated[str, Field(min_length=8, max_length=64)] = Field(
        default_factory=lambda: str(uuid.uuid4())
    )
    t_client: float | None = None
    tick: float | None = None


class AnswerStatus(StrEnum):
    """What became of a command."""

    STORED = "stored"
    DUPLICATE = "duplicate"
    STALE = "stale"
    REJECTED = "rejected"


class Answer(BaseModel):
    """The answer to a command.

    Args:
        status: `stored` only once the event is on the disk.
        rev: the revision now: the trial's, or the control revision.
        seq: number of the stored event.
        message: why not, in words for the operator.
    """

    model_config = ConfigDict(extra="forbid", frozen=True)

    status: AnswerStatus
    rev: int
    seq: int | None = None
    message: str = ""


@dataclass(frozen=True, slots=True)
class Actor:
    """Who sends a command; set by the server, never by the command."""

    operator: str
    source: Source
