"""A session: leads one trial after another through the console's controller to its label.

The journal is the truth and every step is resumable: whatever happens to this process, the next
one continues at the first trial that lacks something.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

from collection.clock import SimulatedClock
from collection.errors import (
    CollectionError,
    DeviceError,
    PlacementError,
    Recovery,
    StoppedError,
)
from collection.session.recorded_time import last_recorded_ns
from collection.trial import TrialContext, run_take
from labeling.control.auto import ACTOR
from labeling.control.commands import AnswerStatus, Command, CommandKind
from labeling.errors import SessionEndingError, TakeEndedError
from logs.journal.events import Paused
from logs.journal.state import STATION_HOLD
from registration.errors import RegistrationError

if TYPE_CHECKING:
    from pathlib import Path

    from collection.scoring.annotator import Annotator
    from labeling.control.controller import SessionController
    from labeling.control.take import Take
    from logs.journal.state import TrialState


@dataclass(slots=True)
class Session:
    """The loop over the planned trials.

    Args:
        context: what all trials share.
        controller: the session's writer.
        annotator: scores and draws what is done.
        folder_of: where a take's record goes, by trial id and take.
        attempts: so many void takes of a trial in a row, and it is left to a person, or skipped.
        attended: a person watches; then the session holds instead of ending.
        say: tells the operator at the terminal.
    """

    context: TrialContext
    controller: SessionController
    annotator: Annotator
    folder_of: Callable[[str, int], Path]
    attempts: int
    attended: bool
    say: Callable[[str], None]
    _disturbed: bool = False

    def run(self) -> None:
        """Run until every planned trial is labelled or skipped, or the session is to end.

        Raises:
            DeviceError: the station needs a person, and nobody is there.
        """
        voids: Counter[str] = Counter()
        self.controller.releases_with(self.context.station.arm.release_stop)
        self._begin_time()
        while (work := self.controller.next_work()) is not None:
            if work.valid_take is None and not self._station_is_ready():
                continue
            take = self.controller.begin(work)
            try:
                if not take.executed:
                    run_take(self.context, take, self.folder_of(take.trial_id, take.number))
                self._settle(work, take)
            except TakeEndedError as ended:
                self.say(str(ended))
            except SessionEndingError:
                return
            except (RegistrationError, PlacementError, DeviceError) as error:
                voids[work.trial_id] += 1
                self._void(work, take, error, voids[work.trial_id])

    def _begin_time(self) -> None:
        """A simulated clock begins with the session, and later where the last record ended."""
        clock = self.context.station.clock
        if isinstance(clock, SimulatedClock):
            clock.begin_at(last_recorded_ns(self.context.session_path))

    def annotate_earlier(self) -> None:
        """Annotate what an earlier process labeled and did not live to annotate."""
        with self.controller.reading() as state:
            trials = [trial for trial in state.order if trial.status == "labelled"]
        for trial in trials:
            take = trial.valid_take
            if take is not None and self.annotator.lacks(take):
                self.annotator.annotate(trial.trial_id, take)

    def _settle(self, work: TrialState, take: Take) -> None:
        decision = take.await_label()
        take.reset()
        if decision.kind == "label" and work.valid_take is not None:
            self.annotator.annotate(work.trial_id, work.valid_take)

    def _void(self, work: TrialState, take: Take, error: Exception, times: int) -> None:
        """Give the take up; the next one brings the station back, or a person has to.

        Nothing moves here: the operator may have stopped the session meanwhile, and the loop
        waits until it may move again.
        """
        take.void(f"{type(error).__name__}: {error}")
        self._show_lights()
        self.say(f"void: {error}")
        self._disturbed = self._disturbed or isinstance(error, DeviceError)
        if self._stopped_by_operator(error):
            return
        if isinstance(error, DeviceError) and error.recovery is Recovery.HALT:
            self._need_person(error)
        elif times >= self.attempts:
            self._give_up(work, f"void {times} times in a row, the last time because: {error}")

    def _give_up(self, work: TrialState, why: str) -> None:
        """Leave a trial that cannot be tried: a person decides, or it is skipped and counted."""
        if self.attended:
            self._need_person(CollectionError(why))
            return
        with self.controller.reading():
            skip = Command(
                kind=CommandKind.SKIP, trial_id=work.trial_id, rev=work.rev, value={"text": why}
            )
        answer = self.controller.submit(skip, ACTOR)
        if answer.status is not AnswerStatus.STORED:
            raise CollectionError(f"{why}; it could not be skipped: {answer.message}")
        self.say(f"skipped: trial {work.planned.number}, {why}")

    def _show_lights(self) -> None:
        arm, camera = self.context.station.arm.state(), self.context.station.camera.state()
        self.controller.set_light("robot", arm.ready, arm.error or "")
        self.controller.set_light("camera", camera.connected, camera.detail)

    def _station_is_ready(self) -> bool:
        """Bring the station back after a fault, a hold or a cleared stop, if it has to be.

        Called only where the session may move: a stop from now on ends the recovery, too.

        Returns:
            False if it did not come back, or was stopped meanwhile: the loop waits again.
        """
        try:
            if self._disturbed or not self.context.station.arm.state().ready:
                self._recover()
        except DeviceError as error:
            self._disturbed = True
            self._show_lights()
            if self._stopped_by_operator(error):
                return False
            self.say(f"the station did not recover: {error}")
            self._need_person(error)
            return False
        self._disturbed = False
        self._show_lights()
        return True

    def _stopped_by_operator(self, error: Exception) -> bool:
        """Whether the session's own stop ended a motion: the loop waits until it is cleared."""
        return isinstance(error, StoppedError) and not self.controller.may_move

    def _recover(self) -> None:
        """Re-initialize the devices.

        Raises:
            DeviceError: the operator stopped it, or only a person can help.
        """
        from collection.robots.motion import recover

        station = self.context.station
        station.arm.connect()
        station.gripper.connect()
        station.camera.connect()
        recover(station.arm, station.gripper, station.config.motion)

    def _need_person(self, error: Exception) -> None:
        if not self.attended:
            raise error
        with self.controller.reading() as state:
            source = state.segments[-1].source
        self.controller.hold(STATION_HOLD, str(error))
        self.controller.record(Paused(operator="the station", source=source))
