"""Everything that can happen in a session, as typed events: the journal's only content.

An event never edits another. A relabel, an undo or a new score is a new event that points at
its trial; operator label, sensor verdict and model score are separate events and never
overwrite one another. What the events add up to is [SessionState][logs.journal.state.SessionState].
"""

from __future__ import annotations

from enum import StrEnum
from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field, JsonValue, TypeAdapter, model_validator

Text = Annotated[str, Field(max_length=2000)]
TakeNumber = Annotated[int, Field(ge=1)]


class Phase(StrEnum):
    """Where a take of a trial stands."""

    PLACE_OBJECT = "PLACE_OBJECT"
    CAPTURE = "CAPTURE"
    REGISTER = "REGISTER"
    CONFIRM_POSE = "CONFIRM_POSE"
    EXECUTE = "EXECUTE"
    AWAITING_LABEL = "AWAITING_LABEL"
    RESET = "RESET"


class Outcome(StrEnum):
    """The operator's answer to the one question: was the object stably lifted?"""

    SUCCESS = "success"
    FAILURE = "failure"


class FailureReason(StrEnum):
    """Why a grasp failed, as the operator saw it."""

    MISSED = "missed"
    SLIPPED_ON_LIFT = "slipped_on_lift"
    DROPPED_WHILE_HELD = "dropped_while_held"
    TIPPED_BEFORE_CONTACT = "tipped_before_contact"
    COLLISION = "collision"
    OTHER = "other"


class RedoCause(StrEnum):
    """Why a take does not count: what went wrong before the jaws closed."""

    PLACEMENT = "placement"
    SEEING = "seeing"
    MOVING = "moving"


class Source(StrEnum):
    """Who decided: a person, or the simulated operator that looks at the simulation's truth."""

    OPERATOR = "operator"
    OPERATOR_SIM = "operator_sim"


class EventBase(BaseModel):
    """What all events share."""

    model_config = ConfigDict(extra="forbid", frozen=True)


class TrialEvent(EventBase):
    """An event about one trial."""

    trial_id: str


class TakeEvent(TrialEvent):
    """An event about one take (attempt) of one trial; takes count from 1."""

    take: TakeNumber


class Decided(EventBase):
    """Who decided, and the identity of the command, so that a repeated command is recognized."""

    operator: str
    source: Source
    command_id: str | None = None


# ---------------------------------------------------------------------------------------------
# The session


class SessionCreated(EventBase):
    """The folder was created; the journal's first line."""

    kind: Literal["session_created"] = "session_created"
    session_id: str


class SessionOpened(EventBase):
    """A process became the session's writer: at the start and at every resume.

    What was under way when the last writer ended is over: an unexecuted take is interrupted.
    """

    kind: Literal["session_opened"] = "session_opened"
    segment: int = Field(ge=0, description="grows when an accepted change of set-up begins")
    fingerprints: dict[str, str]
    accepted: tuple[str, ...] = ()
    operator: str
    source: Source


class SessionClosed(EventBase):
    """The writer ended in order."""

    kind: Literal["session_closed"] = "session_closed"
    status: Literal["finished", "ended", "failed"]
    reason: Text = ""


class Paused(Decided):
    """The operator asked that nothing new starts."""

    kind: Literal["paused"] = "paused"


class Resumed(Decided):
    """The operator ended a pause, and the holds that a person may end."""

    kind: Literal["resumed"] = "resumed"


class Held(EventBase):
    """The station holds by itself: a lost connection, a device fault, a full disk."""

    kind: Literal["held"] = "held"
    cause: str
    text: Text = ""


class Released(EventBase):
    """The cause of a hold is gone."""

    kind: Literal["released"] = "released"
    cause: str


class Stopped(Decided):
    """The software stop was pressed; it acted before this line was written."""

    kind: Literal["stopped"] = "stopped"
    reason: Text = ""


class StopCleared(Decided):
    """A person confirmed that the station may move again."""

    kind: Literal["stop_cleared"] = "stop_cleared"


class JournalRepaired(EventBase):
    """`reach recover` set damaged lines aside; their sequence numbers are named here."""

    kind: Literal["journal_repaired"] = "journal_repaired"
    lost: tuple[int, ...]
    text: Text = ""


# ---------------------------------------------------------------------------------------------
# A take, from placing to executed


class TrialStarted(TakeEvent):
    """A take of a trial began."""

    kind: Literal["trial_started"] = "trial_started"


class PhaseEntered(TakeEvent):
    """A take reached a phase; `info` is what the console shows about it."""

    kind: Literal["phase"] = "phase"
    phase: Phase
    info: dict[str, JsonValue] = {}


class Placed(TakeEvent, Decided):
    """The operator put the object on the table."""

    kind: Literal["placed"] = "placed"


class PoseAccepted(TakeEvent, Decided):
    """The operator chose among ambiguous poses: 0 is the best, 1, 2, ... are its rivals."""

    kind: Literal["pose_accepted"] = "pose_accepted"
    rival: int = Field(ge=0)


class ObjectReplaced(TakeEvent, Decided):
    """The operator refused every pose and puts the object down again."""

    kind: Literal["object_replaced"] = "object_replaced"


class TrueOutcome(BaseModel):
    """What really happened, which only a simulation knows."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    outcome: Outcome
    rotated: bool = False
    reason: FailureReason | None = None


class SensorVerdict(BaseModel):
    """What the gripper's own sensors say about the lift; never the label.

    `truth` is the simulation's outcome and absent on a real station.
    """

    model_config = ConfigDict(extra="forbid", frozen=True)

    lifted: bool | None
    jaw_width: float | None = Field(default=None, description="[m], at the end of the hold")
    truth: TrueOutcome | None = None


class Executed(TakeEvent):
    """The robot finished and the take's record is complete on the disk."""

    kind: Literal["executed"] = "executed"
    record: str = Field(description="path of the record, relative to the session's folder")
    sensor: SensorVerdict
    recovered: bool = Field(default=False, description="found by recovery, not by the session")


# ---------------------------------------------------------------------------------------------
# Decisions about a take


class LabelEvent(TakeEvent, Decided):
    """An operator's verdict on an executed take."""

    outcome: Outcome
    rotated: bool = Field(default=False, description="turned in the grasp; still a success")
    reason: FailureReason | None = None
    note: Text = ""
    blind: bool = Field(default=True, description="decided without having seen a prediction")

    @model_validator(mode="after")
    def _reason_belongs_to_failure(self) -> LabelEvent:
        if self.outcome is Outcome.FAILURE and self.reason is None:
            raise ValueError(
                f"a failure needs a reason: {', '.join(FailureReason)} (reason is missing)"
            )
        if self.outcome is Outcome.SUCCESS and self.reason is not None:
            raise ValueError(f"a success has no failure reason (got {self.reason.value!r})")
        return self


class Labelled(LabelEvent):
    """The first verdict, given while the trial was awaiting it."""

    kind: Literal["label"] = "label"


class Relabelled(LabelEvent):
    """A later verdict; the newest one counts.

    `found_by` names the filter through which the trial was found; a verdict on a trial found
    through its disagreement with a model is not blind.
    """

    kind: Literal["relabel"] = "relabel"
    found_by: str | None = None


class SecondLabelled(LabelEvent):
    """A second operator's blind verdict: for agreement, it never replaces the label."""

    kind: Literal["second_label"] = "second_label"


class Redone(TakeEvent, Decided):
    """The take does not count and the trial is taken again; the old take is kept and flagged."""

    kind: Literal["redo"] = "redo"
    cause: RedoCause
    note: Text = ""


class Voided(TakeEvent):
    """The take is void (no pose found, a device fault, a stop): the trial is taken again."""

    kind: Literal["void"] = "void"
    reason: Text
    operator: str | None = None
    source: Source | None = None
    command_id: str | None = None


class Skipped(TrialEvent, Decided):
    """The trial is left out of the session."""

    kind: Literal["skip"] = "skip"
    note: Text = ""


class Undone(TrialEvent, Decided):
    """The trial's newest decision (label, relabel, redo, skip) no longer holds."""

    kind: Literal["undo"] = "undo"
    undoes: int = Field(description="sequence number of the decision")


class NeedsLabel(TrialEvent):
    """Recovery could not vouch for the trial's label: it is asked for again."""

    kind: Literal["needs_label"] = "needs_label"
    why: Text


class Scored(TakeEvent):
    """A model's prediction for an executed take."""

    kind: Literal["score"] = "score"
    model: str
    version: str
    value: float = Field(ge=0, le=1)
    details: dict[str, JsonValue] = {}


class Noted(Decided):
    """A remark, about a trial or about the session."""

    kind: Literal["note"] = "note"
    trial_id: str | None = None
    text: Text


AnyEvent = (
    SessionCreated
    | SessionOpened
    | SessionClosed
    | Paused
    | Resumed
    | Held
    | Released
    | Stopped
    | StopCleared
    | JournalRepaired
    | TrialStarted
    | PhaseEntered
    | Placed
    | PoseAccepted
    | ObjectReplaced
    | Executed
    | Labelled
    | Relabelled
    | SecondLabelled
    | Redone
    | Voided
    | Skipped
    | Undone
    | NeedsLabel
    | Scored
    | Noted
)
Event = Annotated[AnyEvent, Field(discriminator="kind")]
EVENT: TypeAdapter[AnyEvent] = TypeAdapter(Event)


class Entry(BaseModel):
    """An event as it stands in the journal.

    Args:
        seq: place in the journal, from 1, without gaps.
        time_ns: when it was written, nanoseconds since the epoch.
        event: what happened.
    """

    model_config = ConfigDict(extra="forbid", frozen=True)

    seq: int = Field(ge=1)
    time_ns: int
    event: Event
