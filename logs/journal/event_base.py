"""What events share: nothing, a trial, a take, and whoever decided."""

from __future__ import annotations

from typing import Annotated, Any

from pydantic import BaseModel, BeforeValidator, ConfigDict, Field

from logs.journal.vocabulary import Source

LONGEST_TEXT = 2000
"""Of a reason or a note [characters]; a console refuses a longer note from a person."""


def _shortened(text: Any) -> Any:
    """Cut a text that is too long: how a fault is worded must not keep it out of the journal."""
    too_long = isinstance(text, str) and len(text) > LONGEST_TEXT
    return f"{text[: LONGEST_TEXT - 4]} ..." if too_long else text


Text = Annotated[str, BeforeValidator(_shortened)]
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
