"""Where one planned trial stands, and each of its takes: the leaves of the session's state."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Literal

from pydantic import BaseModel, ConfigDict

from logs.journal import events as ev
from logs.journal.events import Entry, LabelEvent, Phase

TakeStatus = Literal["running", "executed", "redone", "voided", "interrupted"]
TrialStatus = Literal["pending", "running", "unlabelled", "labelled", "skipped"]


class PlannedEntry(BaseModel):
    """One planned trial, as the session needs it; the full plan lies beside in plan.json."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    number: int
    trial_id: str
    grasp_id: str
    object_name: str
    repeat: int = 0
    stable_pose: int | None = None


@dataclass(slots=True)
class TakeState:
    """One take of a trial.

    Args:
        take: counts from 1.
        segment: of the session in which it was executed: grows with each accepted change of set-up.
        labels: all verdicts that hold, oldest first.
        second_verdicts: all further operators' verdicts that hold, oldest first.
        stopped: the software stop was pressed between placing and the end of the motion.
    """

    take: int
    status: TakeStatus = "running"
    segment: int = 0
    phase: Phase = Phase.PLACE_OBJECT
    info: dict[str, object] = field(default_factory=dict)
    record: str | None = None
    recovered: bool = False
    sensor: ev.SensorVerdict | None = None
    executed_ns: int | None = None
    placed: bool = False
    replaced: bool = False
    accepted_rival: int | None = None
    labels: list[tuple[Entry, LabelEvent]] = field(default_factory=list)
    second_verdicts: list[tuple[Entry, LabelEvent]] = field(default_factory=list)
    stopped: bool = False
    scores: dict[str, ev.Scored] = field(default_factory=dict)
    ended_because: str = ""

    @property
    def label(self) -> LabelEvent | None:
        """The newest verdict that holds."""
        return self.labels[-1][1] if self.labels else None

    @property
    def second_labels(self) -> dict[str, LabelEvent]:
        """Each further operator's newest verdict that holds."""
        return {label.operator: label for _, label in self.second_verdicts}

    def second_entry(self, operator: str) -> Entry | None:
        """The entry of a further operator's newest verdict that holds."""
        own = (
            entry for entry, label in reversed(self.second_verdicts) if label.operator == operator
        )
        return next(own, None)

    @property
    def blind_label(self) -> LabelEvent | None:
        """The newest verdict that was given without having seen a prediction."""
        return next((label for _, label in reversed(self.labels) if label.blind), None)


@dataclass(slots=True)
class TrialState:
    """One planned trial and its takes.

    Args:
        rev: grows with every event that changes what the operator would decide upon.
        decisions: label, relabel, redo, void and skip entries that hold, oldest first.
    """

    planned: PlannedEntry
    takes: list[TakeState] = field(default_factory=list)
    skipped: bool = False
    rev: int = 0
    decisions: list[Entry] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)
    needs_label: str = ""

    @property
    def trial_id(self) -> str:
        """The trial's identity."""
        return self.planned.trial_id

    @property
    def valid_take(self) -> TakeState | None:
        """The newest executed take that counts."""
        return next((take for take in reversed(self.takes) if take.status == "executed"), None)

    @property
    def active_take(self) -> TakeState | None:
        """The take a console is about: the running one, else the one that counts."""
        if self.takes and self.takes[-1].status == "running":
            return self.takes[-1]
        return self.valid_take or (self.takes[-1] if self.takes else None)

    @property
    def label(self) -> LabelEvent | None:
        """The verdict that counts."""
        take = self.valid_take
        return take.label if take else None

    @property
    def status(self) -> TrialStatus:
        """Where the trial stands."""
        if self.skipped:
            return "skipped"
        take = self.valid_take
        if take is not None:
            return "labelled" if take.label is not None else "unlabelled"
        running = bool(self.takes) and self.takes[-1].status == "running"
        return "running" if running else "pending"

    def find_take(self, number: int) -> TakeState:
        """The take of that number; a repaired journal may lack the line that began it."""
        while len(self.takes) < number:
            self.takes.append(TakeState(len(self.takes) + 1, status="interrupted"))
        return self.takes[number - 1]


@dataclass(frozen=True, slots=True)
class Counts:
    """The session in numbers.

    Args:
        done: trials with an executed take that counts.
        voided: takes that were void or interrupted; each was or will be taken again.
        redone: takes the operator wanted again.
    """

    planned: int
    done: int
    labelled: int
    unlabelled: int
    voided: int
    redone: int
    skipped: int
    successes: int
