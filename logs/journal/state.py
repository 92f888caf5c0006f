"""What a session's events add up to: which trials are done, labelled, or still to do.

The state is a pure fold of the journal over the planned order: after a kill, the next process
folds the same events and stands where the last one stood.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from logs.journal import events as ev
from logs.journal.disclosure import Disclosure
from logs.journal.events import AnyEvent, Entry, Outcome, Phase
from logs.journal.trial_state import Counts, PlannedEntry, TakeState, TakeStatus, TrialState

__all__ = ["Counts", "PlannedEntry", "SessionState", "TakeState", "TrialState"]


STATION_HOLD = "station"
"""Cause of a hold that a person ends, with Resume, after having looked at the station."""


class SessionState:
    """The fold. Feed it entries in order; read it at any time.

    Args:
        planned: the trials in their planned order.
    """

    def __init__(self, planned: Sequence[PlannedEntry]) -> None:
        self.trials: dict[str, TrialState] = {
            entry.trial_id: TrialState(entry) for entry in planned
        }
        self._disclosure = Disclosure(self.trials.values())
        self.current: str | None = None
        self.paused = False
        self.stopped = False
        self.holds: dict[str, str] = {}
        self.control_rev = 0
        self.commands: dict[str, Entry] = {}
        self.segment = -1
        self.opened_ns: int | None = None
        self.fingerprints: dict[str, str] = {}
        self.segments: list[ev.SessionOpened] = []
        self.closed: ev.SessionClosed | None = None
        self.notes: list[str] = []
        self.seq = 0

    @classmethod
    def fold(cls, planned: Sequence[PlannedEntry], entries: Iterable[Entry]) -> SessionState:
        """The state after all these entries."""
        state = cls(planned)
        for entry in entries:
            state.apply(entry)
        return state

    @property
    def order(self) -> list[TrialState]:
        """The trials in their planned order."""
        return list(self.trials.values())

    @property
    def current_trial(self) -> TrialState | None:
        """The trial under way."""
        return self.trials[self.current] if self.current is not None else None

    def counts(self) -> Counts:
        """The session in numbers."""
        statuses = [trial.status for trial in self.trials.values()]
        takes = [take.status for trial in self.trials.values() for take in trial.takes]
        labels = [trial.label for trial in self.trials.values() if trial.status == "labelled"]
        labelled, unlabelled = statuses.count("labelled"), statuses.count("unlabelled")
        return Counts(
            planned=len(statuses),
            done=labelled + unlabelled,
            labelled=labelled,
            unlabelled=unlabelled,
            voided=takes.count("voided") + takes.count("interrupted"),
            redone=takes.count("redone"),
            skipped=statuses.count("skipped"),
            successes=sum(
                label is not None and label.outcome is Outcome.SUCCESS for label in labels
            ),
        )

    def shows_scores(self, trial: TrialState) -> bool:
        """True if a console may show the trial's scores: nobody is to label its grasp blindly."""
        return self._disclosure.shows(trial.planned.grasp_id)

    def shown_to(self, trial: TrialState) -> frozenset[str]:
        """The operators who have seen a prediction for the trial's grasp."""
        return self._disclosure.seen_by(trial.planned.grasp_id)

    def next_work(self) -> TrialState | None:
        """The trial to attend to next: first those that only lack a label, then the plan's."""
        for wanted in ("unlabelled", "running", "pending"):
            for trial in self.trials.values():
                if trial.status == wanted:
                    return trial
        return None

    def last_decision(self, after: int = 0) -> tuple[TrialState, Entry] | None:
        """The newest decision that holds: what undo would take back.

        Args:
            after: only decisions that the journal got after this entry's number.
        """
        made = [(trial, trial.decisions[-1]) for trial in self.trials.values() if trial.decisions]
        made = [pair for pair in made if pair[1].seq > after]
        return max(made, key=lambda pair: pair[1].seq, default=None)

    def last_second_verdict(self, operator: str, after: int = 0) -> tuple[TrialState, Entry] | None:
        """A further operator's newest verdict that holds: what their undo would take back.

        Args:
            operator: whose verdicts.
            after: only verdicts that the journal got after this entry's number.
        """
        given = [
            (trial, entry)
            for trial in self.trials.values()
            if (take := trial.valid_take) is not None
            and (entry := take.second_entry(operator)) is not None
            and entry.seq > after
        ]
        return max(given, key=lambda pair: pair[1].seq, default=None)

    def stand_down(self) -> None:
        """Nobody leads the session: a stop, pause or hold of its last sitting is over."""
        self.paused = self.stopped = False
        self.holds.clear()

    def apply(self, entry: Entry) -> None:
        """Add one entry."""
        event = entry.event
        self.seq = entry.seq
        command = getattr(event, "command_id", None)
        if command is not None:
            self.commands[command] = entry
        trial_id = getattr(event, "trial_id", None)
        if trial_id is None:
            self._apply_control(entry)
        elif trial_id in self.trials:
            trial = self.trials[trial_id]
            self._apply_trial(trial, entry)
            leader = self.segments[-1].operator if self.segments else None
            self._disclosure.note(trial.planned.grasp_id, leader)

    def _apply_control(self, entry: Entry) -> None:
        event = entry.event
        self.control_rev += 1
        match event:
            case ev.SessionOpened():
                self._open(event)
                self.opened_ns = entry.time_ns
            case ev.SessionClosed():
                self.closed = event
                self._end_running("the session ended")
            case ev.Paused():
                self.paused = True
            case ev.Resumed():
                self.paused = False
                self.holds.pop(STATION_HOLD, None)
            case ev.Held():
                self.holds[event.cause] = event.text
            case ev.Released():
                self.holds.pop(event.cause, None)
            case ev.Stopped():
                self._stop()
            case ev.StopCleared():
                self.stopped = False
            case ev.Noted():
                self.notes.append(event.text)
            case _:
                pass

    def _open(self, event: ev.SessionOpened) -> None:
        self._end_running("the session was interrupted")
        self.segment, self.fingerprints = event.segment, event.fingerprints
        self.segments.append(event)
        self.closed = None
        self.stand_down()
        self._disclosure.note_all(event.operator)

    def _stop(self) -> None:
        self.stopped = True
        trial = self.current_trial
        if trial is not None and trial.takes and trial.takes[-1].status == "running":
            take = trial.takes[-1]
            take.stopped = take.stopped or take.phase is not Phase.PLACE_OBJECT

    def _end_running(self, because: str) -> None:
        self.current = None
        for trial in self.trials.values():
            if trial.takes and trial.takes[-1].status == "running":
                trial.takes[-1].status = "interrupted"
                trial.takes[-1].ended_because = because
                trial.rev += 1

    def _apply_trial(self, trial: TrialState, entry: Entry) -> None:
        event = entry.event
        match event:
            case ev.Scored():
                trial.find_take(event.take).scores[event.model] = event
                return
            case ev.Noted():
                trial.notes.append(event.text)
                return
            case ev.PhaseEntered():
                self._enter_phase(trial, event)
                return
        trial.rev += 1
        match event:
            case ev.TrialStarted() | ev.Placed() | ev.PoseAccepted() | ev.ObjectReplaced():
                self._apply_progress(trial, event)
            case ev.Executed():
                self._execute(trial, entry, event)
            case ev.NeedsLabel():
                self._forget_labels(trial, event.why)
            case ev.Undone():
                self._undo(trial, event.undoes)
            case _:
                self._decide(trial, entry)

    def _enter_phase(self, trial: TrialState, event: ev.PhaseEntered) -> None:
        take = trial.find_take(event.take)
        self.current = trial.trial_id
        if event.phase not in (take.phase, Phase.RESET):
            trial.rev += 1  # news about the same phase, or going home, changes no decision
            take.placed = take.placed and event.phase is not Phase.PLACE_OBJECT
            if event.phase is Phase.CONFIRM_POSE:
                take.accepted_rival, take.replaced = None, False
        take.phase = event.phase
        take.info.update(event.info)

    def _apply_progress(self, trial: TrialState, event: AnyEvent) -> None:
        match event:
            case ev.TrialStarted(take=number):
                trial.find_take(number).status = "running"
                self.current = trial.trial_id
            case ev.Placed(take=number):
                trial.find_take(number).placed = True
            case ev.PoseAccepted(take=number, rival=rival):
                trial.find_take(number).accepted_rival = rival
            case ev.ObjectReplaced(take=number):
                trial.find_take(number).replaced = True
            case _:
                pass

    def _execute(self, trial: TrialState, entry: Entry, event: ev.Executed) -> None:
        take = trial.find_take(event.take)
        take.status, take.record, take.sensor = "executed", event.record, event.sensor
        take.recovered, take.executed_ns = event.recovered, entry.time_ns
        take.segment = max(self.segment, 0)
        take.phase = Phase.AWAITING_LABEL
        trial.decisions.clear()  # what was decided about earlier takes is settled

    def _decide(self, trial: TrialState, entry: Entry) -> None:
        match entry.event:
            case ev.Labelled() | ev.Relabelled() as event:
                trial.find_take(event.take).labels.append((entry, event))
                trial.needs_label = ""
                trial.decisions.append(entry)
            case ev.SecondLabelled() as event:
                trial.find_take(event.take).second_verdicts.append((entry, event))
            case ev.Redone() as event:
                self._end_take(trial, entry, "redone", event.cause.value)
            case ev.Skipped():
                trial.skipped = True
                self._leave_take(trial, "skipped")
                trial.decisions.append(entry)
            case ev.Voided() as event:
                self._end_take(trial, entry, "voided", event.reason)
            case _:
                pass

    def _end_take(self, trial: TrialState, entry: Entry, status: TakeStatus, because: str) -> None:
        take = trial.find_take(entry.event.take)  # type: ignore[union-attr]
        take.status, take.ended_because = status, because
        if take.record is not None:  # only what was executed can be brought back
            trial.decisions.append(entry)

    def _leave_take(self, trial: TrialState, because: str) -> None:
        if trial.takes and trial.takes[-1].status == "running":
            trial.takes[-1].status = "voided"
            trial.takes[-1].ended_because = because

    def _undo(self, trial: TrialState, seq: int) -> None:
        for take in trial.takes:
            take.second_verdicts = [pair for pair in take.second_verdicts if pair[0].seq != seq]
        undone = [entry for entry in trial.decisions if entry.seq == seq]
        trial.decisions = [entry for entry in trial.decisions if entry.seq != seq]
        for event in (entry.event for entry in undone):
            match event:
                case ev.Labelled() | ev.Relabelled():
                    take = trial.find_take(event.take)
                    take.labels = [pair for pair in take.labels if pair[0].seq != seq]
                case ev.Redone() | ev.Voided():
                    self._leave_take(trial, "the earlier take counts again")
                    trial.find_take(event.take).status = "executed"
                case ev.Skipped():
                    trial.skipped = False
                case _:
                    pass

    def _forget_labels(self, trial: TrialState, why: str) -> None:
        trial.needs_label = why
        trial.decisions.clear()
        take = trial.valid_take
        if take is not None:
            take.labels.clear()
