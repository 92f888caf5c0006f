"""Everything that can happen in a session, as typed events: the journal's only content.

An event never edits another. A relabel, an undo or a new score is a new event that points at
its trial; operator label, sensor verdict and model score are separate events and never
overwrite one another. What the events add up to is [SessionState][logs.journal.state.SessionState].

The kinds lie in files by what they are about; this one names them all.
"""

from __future__ import annotations

from typing import Annotated

from pydantic import BaseModel, ConfigDict, Field, TypeAdapter

from logs.journal.decision_events import (
    LabelEvent,
    Labelled,
    NeedsLabel,
    Redone,
    Relabelled,
    SecondLabelled,
    Skipped,
    Undone,
    Voided,
)
from logs.journal.event_base import EventBase
from logs.journal.session_events import (
    Held,
    JournalRepaired,
    Noted,
    Paused,
    Released,
    Resumed,
    SessionClosed,
    SessionCreated,
    SessionOpened,
    StopCleared,
    Stopped,
)
from logs.journal.take_events import (
    Executed,
    ObjectReplaced,
    PhaseEntered,
    Placed,
    PoseAccepted,
    Scored,
    SensorVerdict,
    TrialStarted,
    TrueOutcome,
)
from logs.journal.vocabulary import FailureReason, Outcome, Phase, RedoCause, Source

__all__ = [
    "AnyEvent",
    "EVENT",
    "Entry",
    "EventBase",
    "Executed",
    "FailureReason",
    "Held",
    "JournalRepaired",
    "LabelEvent",
    "Labelled",
    "NeedsLabel",
    "Noted",
    "ObjectReplaced",
    "Outcome",
    "Paused",
    "Phase",
    "PhaseEntered",
    "Placed",
    "PoseAccepted",
    "RedoCause",
    "Redone",
    "Relabelled",
    "Released",
    "Resumed",
    "Scored",
    "SecondLabelled",
    "SensorVerdict",
    "SessionClosed",
    "SessionCreated",
    "SessionOpened",
    "Skipped",
    "Source",
    "StopCleared",
    "Stopped",
    "TrialStarted",
    "TrueOutcome",
    "Undone",
    "Voided",
]

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
