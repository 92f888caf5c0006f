"""The simulated operator: looks at the simulation's true outcome and submits like a person.

It uses the same commands, revisions and answers as the web page; its every event is marked
`operator_sim`, so that no simulated label can pass for a person's.
"""

from __future__ import annotations

import threading
from collections.abc import Callable, Mapping
from types import TracebackType
from typing import Final, Self

from pydantic import JsonValue

from labeling.control.commands import Actor, Command, CommandKind
from labeling.control.controller import SessionController
from logs.journal.events import Phase, Source
from logs.journal.state import SessionState, TakeState, TrialState

ACTOR: Final = Actor("simulated operator", Source.OPERATOR_SIM)

Value = dict[str, JsonValue]


def first_pose(trial: TrialState, take: TakeState) -> int:
    """Accept the best pose, as an operator would who sees no difference."""
    return 0


class AutoOperator:
    """Answers whatever the controller waits for, in a thread of its own; a context manager.

    Args:
        controller: the session's controller.
        choose_pose: which pose is the right one; looks at the simulation.

    Raises:
        Exception: on leaving, what kept the operator from answering; the session was ended.
    """

    def __init__(
        self,
        controller: SessionController,
        *,
        choose_pose: Callable[[TrialState, TakeState], int] = first_pose,
    ) -> None:
        self._controller = controller
        self._choose_pose = choose_pose
        self._leaving = threading.Event()
        self._trouble: Exception | None = None
        self._thread = threading.Thread(target=self._run, name="auto operator", daemon=True)

    def __enter__(self) -> Self:
        self._thread.start()
        return self

    def __exit__(
        self,
        exc_type: type[BaseException] | None,
        exc: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        self._leaving.set()
        self._controller.announce()
        self._thread.join()
        if exc is None and self._trouble is not None:
            raise self._trouble

    def _run(self) -> None:
        try:
            self._operate()
        except Exception as error:  # a session must not wait for an operator who is gone
            self._trouble = error
            self._controller.request_end()

    def _operate(self) -> None:
        while not (self._leaving.is_set() or self._controller.closed):
            with self._controller.reading() as state:
                command = self._next_command(state)
                version = self._controller.version
            if command is not None:
                self._controller.submit(command, ACTOR)
            # Storing changes the version; a refused command waits here for the next change.
            self._controller.wait_version(version)

    def _next_command(self, state: SessionState) -> Command | None:
        trial = state.current_trial
        take = trial.active_take if trial else None
        if trial is None or take is None or state.stopped or state.paused or state.holds:
            return None
        asked = self._answer(trial, take)
        if asked is None:
            return None
        kind, value = asked
        return Command(kind=kind, trial_id=trial.trial_id, rev=trial.rev, value=dict(value))

    def _answer(
        self, trial: TrialState, take: TakeState
    ) -> tuple[CommandKind, Mapping[str, JsonValue]] | None:
        match take.status, take.phase:
            case "running", Phase.PLACE_OBJECT if not take.placed:
                return CommandKind.PLACED, {}
            case "running", Phase.CONFIRM_POSE if take.accepted_rival is None:
                return CommandKind.ACCEPT_POSE, {"rival": self._choose_pose(trial, take)}
            case "executed", Phase.AWAITING_LABEL if take.label is None:
                return _verdict(take)
        return None


def _verdict(take: TakeState) -> tuple[CommandKind, Mapping[str, JsonValue]]:
    truth = take.sensor.truth if take.sensor else None
    if truth is None:  # a record that recovery saved: nobody saw how it ended
        return CommandKind.REDO, {"cause": "seeing", "note": "the true outcome was lost"}
    return CommandKind.LABEL, truth.model_dump(mode="json")
