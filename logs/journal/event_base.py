"""What events share: nothing, a trial, a take, and whoever decided."""

from __future__ import annotations

from typing import Annotated

from pydantic import BaseModel, ConfigDict, Field

from logs.journal.vocabulary import Source

Text = Annotated[str, Field(max_length=2000)]
TakeNumber = Annotated[int, Field(ge=1)]


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
