"""Events of a take, from its beginning to what is known of it: placed, seen, executed, scored."""

from __future__ import annotations

from typing import Literal

from pydantic import BaseModel, ConfigDict, Field, JsonValue

from logs.journal.event_base import Decided, TakeEvent
from logs.journal.vocabulary import FailureReason, Outcome, Phase


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


class Scored(TakeEvent):
    """A model's prediction for an executed take."""

    kind: Literal["score"] = "score"
    model: str
    version: str
    value: float = Field(ge=0, le=1)
    details: dict[str, JsonValue] = {}
