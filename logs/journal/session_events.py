"""Events of the session as a whole: opened, closed, paused, held, stopped, repaired, remarked."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from logs.journal.event_base import Decided, EventBase, Text
from logs.journal.vocabulary import Source


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


class Noted(Decided):
    """A remark, about a trial or about the session."""

    kind: Literal["note"] = "note"
    trial_id: str | None = None
    text: Text
