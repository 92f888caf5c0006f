"""One take of one trial, as the session's loop leads it: place, see, execute, ask.

Every step raises [TakeEndedError][labeling.errors.TakeEndedError] once the operator has skipped,
redone, voided or stopped the take; the loop then goes on to the next work.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final, Literal

from pydantic import JsonValue

from labeling.errors import TakeEndedError
from logs.journal import events as ev
from logs.journal.events import LabelEvent, Phase, SensorVerdict
from logs.journal.state import TakeState, TrialState

if TYPE_CHECKING:
    from labeling.control.controller import SessionController

STOPPED: Final = "software stop"


@dataclass(frozen=True, slots=True)
class Decision:
    """How the operator settled an executed take; `label` is set if `kind` is `label`."""

    kind: Literal["label", "redo", "void", "skip"]
    label: LabelEvent | None = None


class Take:
    """A take under way; made by [begin][labeling.control.controller.SessionController.begin].

    Args:
        controller: the session's controller.
        trial: the folded state of the trial.
        state: the folded state of this take.
    """

    def __init__(self, controller: SessionController, trial: TrialState, state: TakeState) -> None:
        self._controller = controller
        self._trial = trial
        self._state = state

    @property
    def trial_id(self) -> str:
        """Identity of the trial."""
        return self._trial.trial_id

    @property
    def number(self) -> int:
        """Number of this take, from 1."""
        return self._state.take

    @property
    def executed(self) -> bool:
        """True if the robot has executed it: only the label is missing."""
        return self._state.status == "executed"

    def show(self, info: Mapping[str, JsonValue]) -> None:
        """Add what the console shows about the current phase."""
        self._enter(self._state.phase, info)

    def wait_placed(self) -> None:
        """Wait until the operator has put the object on the table.

        Raises:
            TakeEndedError: if the take ended instead.
            SessionEndingError: if the session is to end.
        """
        if self._state.phase is not Phase.PLACE_OBJECT:
            self.advance(Phase.PLACE_OBJECT)
        self._wait(lambda: self._state.placed)

    def advance(self, phase: Phase, info: Mapping[str, JsonValue] | None = None) -> None:
        """Enter a phase; waits while the session is paused or held.

        Raises:
            TakeEndedError: if the take ended, or the software stop was pressed in it.
            SessionEndingError: if the session is to end.
        """
        self._wait(lambda: self._controller.may_move)
        self._enter(phase, info or {})

    def confirm_pose(self, info: Mapping[str, JsonValue]) -> int | None:
        """Ask which of the poses is the right one.

        Args:
            info: what the console shows; `rivals` is a list with one item per rival pose.

        Returns:
            0 for the best pose, 1, 2, ... for its rivals, None if the object is to be put down
            again: then go back to [wait_placed][labeling.control.take.Take.wait_placed].

        Raises:
            TakeEndedError: as for [advance][labeling.control.take.Take.advance].
            SessionEndingError: if the session is to end.
        """
        self.advance(Phase.CONFIRM_POSE, info)
        self._wait(lambda: self._state.accepted_rival is not None or self._state.replaced)
        return None if self._state.replaced else self._state.accepted_rival

    def record_executed(self, record: str, sensor: SensorVerdict) -> None:
        """The robot has finished and the record is closed: from now on a label is due.

        Args:
            record: path of the record, relative to the session's folder.
            sensor: what the gripper's sensors say.

        Raises:
            TakeEndedError: if the software stop was pressed during the motion; the take is void.
        """
        self._require_running()
        self._controller.record(
            ev.Executed(trial_id=self.trial_id, take=self.number, record=record, sensor=sensor)
        )

    def await_label(self) -> Decision:
        """Ask for the verdict, and wait for it or for what the operator decides instead.

        Raises:
            SessionEndingError: if the session is to end first; the label is asked for on resume.
        """
        with self._controller.reading() as state:
            current = state.current == self.trial_id
        if self.executed and not (current and self._state.phase is Phase.AWAITING_LABEL):
            self._enter(Phase.AWAITING_LABEL, {})
        self._controller.wait_until(lambda: self._decision() is not None)
        decision = self._decision()
        assert decision is not None  # wait_until saw it, and only the loop begins takes
        return decision

    def void(self, reason: str) -> None:
        """Declare the take void: the trial is taken again. Harmless if it has ended already."""
        if self._running or self.executed:
            self._controller.record(
                ev.Voided(trial_id=self.trial_id, take=self.number, reason=reason)
            )

    def reset(self) -> None:
        """Enter the phase between two takes, whatever was decided."""
        self._enter(Phase.RESET, {})

    @property
    def _running(self) -> bool:
        return self._state.status == "running"

    def _enter(self, phase: Phase, info: Mapping[str, JsonValue]) -> None:
        self._controller.record(
            ev.PhaseEntered(trial_id=self.trial_id, take=self.number, phase=phase, info=dict(info))
        )

    def _wait(self, condition: Callable[[], bool]) -> None:
        state = self._state
        self._controller.wait_until(lambda: not self._running or state.stopped or condition())
        self._require_running()

    def _require_running(self) -> None:
        if self._running and self._state.stopped:
            self.void(STOPPED)
        if not self._running:
            raise TakeEndedError(
                f"take {self.number} of trial {self._trial.planned.number} ended:"
                f" {self._state.ended_because or self._state.status}"
            )

    def _decision(self) -> Decision | None:
        if self._trial.skipped:
            return Decision("skip")
        match self._state.status:
            case "executed":
                label = self._state.label
                return Decision("label", label) if label is not None else None
            case "redone":
                return Decision("redo")
            case _:
                return Decision("void")
