"""Events by which a person decides about a trial: verdicts, redo, void, skip, and undo."""

from __future__ import annotations

from typing import Literal

from pydantic import Field, model_validator

from logs.journal.event_base import Decided, TakeEvent, Text, TrialEvent
from logs.journal.vocabulary import FailureReason, Outcome, RedoCause, Source


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
    """A decision no longer holds: the trial's newest, or a second operator's newest verdict."""

    kind: Literal["undo"] = "undo"
    undoes: int = Field(description="sequence number of the decision")


class NeedsLabel(TrialEvent):
    """Recovery could not vouch for the trial's label: it is asked for again."""

    kind: Literal["needs_label"] = "needs_label"
    why: Text
