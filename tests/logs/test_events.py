"""Events on the wire, and what a sequence of them adds up to."""

from __future__ import annotations

import dataclasses
from typing import Any, get_args

import pytest
from pydantic import ValidationError

from logs.journal import events as ev
from logs.journal.events import EVENT, AnyEvent, Entry, FailureReason, Outcome, Phase, Source
from logs.journal.state import PlannedEntry, SessionState

WHO: dict[str, Any] = {"operator": "ann", "source": Source.OPERATOR}
TAKE: dict[str, Any] = {"trial_id": "a", "take": 1}
EXAMPLES: list[AnyEvent] = [
    ev.SessionCreated(session_id="s"),
    ev.SessionOpened(segment=0, fingerprints={"robot": "r"}, **WHO),
    ev.TrialStarted(**TAKE),
    ev.PhaseEntered(**TAKE, phase=Phase.PLACE_OBJECT),
    ev.Placed(**TAKE, **WHO, command_id="c1"),
    ev.PhaseEntered(**TAKE, phase=Phase.CONFIRM_POSE, info={"rivals": [{"angle": 3.1}]}),
    ev.ObjectReplaced(**TAKE, **WHO),
    ev.PoseAccepted(**TAKE, **WHO, rival=1),
    ev.Paused(**WHO),
    ev.Resumed(**WHO),
    ev.Held(cause="robot", text="no answer"),
    ev.Released(cause="robot"),
    ev.Executed(
        **TAKE,
        record="r.mcap",
        sensor=ev.SensorVerdict(
            lifted=True, jaw_width=0.03, truth=ev.TrueOutcome(outcome=Outcome.SUCCESS)
        ),
    ),
    ev.Labelled(**TAKE, **WHO, outcome=Outcome.SUCCESS, rotated=True),
    ev.Scored(**TAKE, model="reach", version="1", value=0.5, details={"margin": 0.1}),
    ev.Relabelled(**TAKE, **WHO, outcome=Outcome.FAILURE, reason=FailureReason.MISSED, blind=False),
    ev.SecondLabelled(**TAKE, operator="bo", source=Source.OPERATOR, outcome=Outcome.SUCCESS),
    ev.Undone(trial_id="a", undoes=16, **WHO),
    ev.Noted(text="dusty", **WHO),
    ev.Stopped(**WHO),
    ev.StopCleared(**WHO),
    ev.NeedsLabel(trial_id="a", why="a line was damaged"),
    ev.Redone(**TAKE, **WHO, cause=ev.RedoCause.MOVING),
    ev.Voided(trial_id="a", take=2, reason="no pose"),
    ev.Skipped(trial_id="b", **WHO),
    ev.JournalRepaired(lost=(99,)),
    ev.SessionClosed(status="ended"),
]


def entries() -> list[Entry]:
    return [Entry(seq=n, time_ns=n, event=event) for n, event in enumerate(EXAMPLES, start=1)]


def plan() -> list[PlannedEntry]:
    return [
        PlannedEntry(number=n, trial_id=name, grasp_id="g", object_name="cube")
        for n, name in enumerate("abc", start=1)
    ]


def test_the_examples_cover_every_kind() -> None:
    assert {type(event) for event in EXAMPLES} == set(get_args(AnyEvent))


def test_one_module_names_every_kind_and_word() -> None:
    assert set(ev.__all__) >= {kind.__name__ for kind in get_args(AnyEvent)}
    assert all(hasattr(ev, name) for name in ev.__all__)


@pytest.mark.parametrize("event", EXAMPLES, ids=lambda event: event.kind)
def test_every_kind_survives_the_wire(event: AnyEvent) -> None:
    assert EVENT.validate_json(event.model_dump_json()) == event


@pytest.mark.parametrize(
    "wire",
    [
        b'{"kind": "unheard_of"}',
        b'{"kind": "released"}',
        b'{"kind": "released", "cause": "robot", "more": 1}',
        b'{"kind": "score", "trial_id": "a", "take": 1, "model": "m", "version": "1", "value": 1.5}',
        b'{"kind": "trial_started", "trial_id": "a", "take": 0}',
    ],
)
def test_what_is_no_event_is_refused(wire: bytes) -> None:
    with pytest.raises(ValidationError):
        EVENT.validate_json(wire)


def summary(state: SessionState) -> Any:
    return (
        dataclasses.asdict(state.counts()),
        [(t.status, t.rev, [(k.status, k.phase) for k in t.takes]) for t in state.order],
        (state.current, state.paused, state.stopped, dict(state.holds), state.control_rev),
        sorted(state.commands),
    )


def test_the_fold_of_a_prefix_is_the_state_at_that_moment() -> None:
    growing = SessionState(plan())
    for index, entry in enumerate(entries(), start=1):
        growing.apply(entry)
        assert summary(SessionState.fold(plan(), entries()[:index])) == summary(growing)


def state_after(kind: str) -> SessionState:
    last = max(n for n, event in enumerate(EXAMPLES, start=1) if event.kind == kind)
    return SessionState.fold(plan(), entries()[:last])


def test_label_sensor_and_score_never_overwrite_one_another() -> None:
    take = state_after("relabel").trials["a"].takes[0]
    assert take.label is not None and take.blind_label is not None
    assert take.label.outcome is Outcome.FAILURE
    assert take.blind_label.outcome is Outcome.SUCCESS
    assert take.sensor is not None and take.sensor.lifted is True
    assert take.scores["reach"].value == 0.5


def test_an_undo_restores_the_verdict_before() -> None:
    label = state_after("undo").trials["a"].label
    assert label is not None and label.outcome is Outcome.SUCCESS


def test_a_label_recovery_cannot_vouch_for_is_due_again() -> None:
    state = state_after("needs_label")
    trial = state.trials["a"]
    assert (trial.status, trial.needs_label) == ("unlabelled", "a line was damaged")
    assert state.next_work() is trial


def test_a_skipped_trial_is_never_work() -> None:
    state = state_after("skip")
    work = state.next_work()
    assert work is not None and work.trial_id == "a"
    assert (state.counts().skipped, state.counts().planned) == (1, 3)


def test_a_take_whose_beginning_was_lost_is_filled_in() -> None:
    late = ev.Executed(trial_id="c", take=2, record="r", sensor=ev.SensorVerdict(lifted=None))
    state = SessionState.fold(plan(), [Entry(seq=1, time_ns=1, event=late)])
    assert [take.status for take in state.trials["c"].takes] == ["interrupted", "executed"]


def test_reopening_ends_pauses_holds_and_what_was_under_way() -> None:
    events: list[AnyEvent] = [
        ev.TrialStarted(**TAKE),
        ev.Paused(**WHO),
        ev.Held(cause="robot"),
        ev.SessionOpened(segment=0, fingerprints={}, **WHO),
    ]
    state = SessionState.fold(
        plan(), [Entry(seq=n, time_ns=n, event=event) for n, event in enumerate(events, start=1)]
    )
    assert (state.paused, state.holds, state.current) == (False, {}, None)
    assert state.trials["a"].takes[0].status == "interrupted"
    assert state.trials["a"].status == "pending"
