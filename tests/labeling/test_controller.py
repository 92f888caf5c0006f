"""The controller's rules: what is stored, what is stale, what is refused, and when."""

from __future__ import annotations

import threading
from collections import Counter
from collections.abc import Callable
from typing import Any

import pytest

from labeling.control.commands import Actor, Command, CommandKind
from labeling.errors import TakeEndedError
from logs.journal.events import Outcome, Phase, Source
from logs.journal.file import read_journal

BOB = Actor("bob", Source.OPERATOR)


def kinds(bench: Any) -> list[str]:
    return [entry.event.kind for entry in read_journal(bench.folder.journal_path)]


def wait_for(bench: Any, condition: Callable[[], bool]) -> None:
    """Wait for the loop's thread, by the controller's own notifications."""
    bench.controller.wait_until(condition)


def test_a_label_is_on_the_disk_before_it_is_acknowledged(bench: Any) -> None:
    bench.executed()
    answer = bench.do("label", 1, outcome="failure", reason="missed", note="too far left")
    last = read_journal(bench.folder.journal_path)[-1]
    assert (answer.status, answer.seq) == ("stored", last.seq)
    assert last.event.model_dump(exclude={"command_id"}) == {
        "kind": "label",
        "trial_id": bench.trial(1).trial_id,
        "take": 1,
        "outcome": Outcome.FAILURE,
        "rotated": False,
        "reason": "missed",
        "note": "too far left",
        "blind": True,
        "operator": "ann",
        "source": "operator",
    }


def test_of_twenty_presses_at_once_one_is_stored(bench: Any) -> None:
    take = bench.executed()
    commands = [bench.command("label", 1, outcome="success") for _ in range(20)]
    gate = threading.Barrier(20)
    answers: list[str] = []

    def press(command: Command) -> None:
        gate.wait()
        answers.append(bench.controller.submit(command, BOB).status)

    threads = [threading.Thread(target=press, args=(command,)) for command in commands]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert Counter(answers) == {"stored": 1, "stale": 19}
    assert kinds(bench).count("label") == 1
    assert take.await_label().kind == "label"


def test_a_repeated_command_is_a_duplicate_also_after_a_restart(
    make_bench: Callable[..., Any],
) -> None:
    first = make_bench()
    first.executed()
    command = first.command("label", 1, outcome="success")
    stored = first.controller.submit(command, BOB)
    again = first.controller.submit(command, BOB)
    assert (stored.status, again.status, again.seq) == ("stored", "duplicate", stored.seq)
    first.controller.close("ended")
    second = make_bench()
    after = second.controller.submit(command, BOB)
    assert (after.status, after.seq) == ("duplicate", stored.seq)
    assert kinds(second).count("label") == 1


@pytest.mark.parametrize("phase", ["before", "placing", "executing", "labelled"])
def test_a_label_is_taken_only_after_the_robot_has_executed(bench: Any, phase: str) -> None:
    if phase == "labelled":
        bench.labelled()
    elif phase != "before":
        take = bench.begin()
        if phase == "executing":
            bench.do("placed", 1)
            take.advance(Phase.EXECUTE)
    answer = bench.do("label", 1, outcome="success")
    assert answer.status == "rejected"
    assert "labeled already" in answer.message or "only after" in answer.message
    assert kinds(bench).count("label") == (phase == "labelled")


def test_a_command_with_an_old_revision_is_stale(bench: Any) -> None:
    bench.executed()
    old = bench.command("label", 1, outcome="success").model_copy(update={"rev": 1})
    assert bench.controller.submit(old, BOB).status == "stale"


def test_a_command_is_stale_after_two_seconds_but_a_stop_never(make_bench: Any) -> None:
    now = [100.0]
    stops: list[float] = []
    bench = make_bench(clock=lambda: now[0], stop=lambda: stops.append(now[0]))
    bench.executed()
    command = bench.command("label", 1, outcome="success").model_copy(update={"tick": 100.0})
    stop = bench.command("stop").model_copy(update={"tick": 100.0})
    now[0] = 102.1
    assert bench.controller.submit(command, BOB).message == "the command is older than 2 s"
    assert bench.controller.submit(stop, BOB).status == "stored"
    assert stops == [102.1]
    bench.do("clear_stop", confirm=True)
    for never_said in (102.2, float("nan"), float("inf")):
        forged = command.model_copy(update={"tick": never_said})
        assert bench.controller.submit(forged, BOB).status == "stale"
    fresh = command.model_copy(update={"tick": 100.2})
    assert bench.controller.submit(fresh, BOB).status == "stored"


@pytest.mark.parametrize(
    ("value", "said"),
    [
        ({"outcome": "failure"}, "a failure needs a reason: missed, slipped_on_lift"),
        ({"outcome": "success", "reason": "missed"}, "no failure reason"),
        ({"outcome": "maybe"}, "outcome"),
        ({}, "outcome"),
        ({"outcome": "success", "operator": "mallory"}, "operator"),
        ({"outcome": "success", "note": "x" * 2001}, "note"),
    ],
)
def test_a_wrong_value_is_rejected_with_what_is_valid(
    bench: Any, value: dict[str, Any], said: str
) -> None:
    bench.executed()
    answer = bench.do("label", 1, **value)
    assert answer.status == "rejected"
    assert said in answer.message
    assert kinds(bench).count("label") == 0


def test_an_unknown_trial_is_rejected(bench: Any) -> None:
    command = Command(kind=CommandKind.LABEL, trial_id="nobody", rev=0, value={})
    assert "no trial 'nobody'" in bench.controller.submit(command, BOB).message


def test_undo_and_relabel_work_in_any_later_state(bench: Any) -> None:
    bench.labelled("failure", reason="missed")
    take = bench.begin()
    assert bench.do("relabel", 1, outcome="success", rotated=True).status == "stored"
    assert bench.trial(1).label.rotated
    bench.do("placed", 2)
    take.advance(Phase.EXECUTE)
    assert bench.do("undo", 1).status == "stored"
    assert bench.trial(1).label.reason == "missed"
    assert bench.do("undo", 1).status == "stored"
    assert bench.trial(1).status == "unlabelled"
    assert "nothing to undo" in bench.do("undo", 1).message


def test_a_trial_whose_label_was_undone_is_asked_for_next(bench: Any) -> None:
    bench.labelled()
    bench.labelled()
    bench.do("undo", 1)
    take = bench.begin()
    assert (take.trial_id, take.executed) == (bench.trial(1).trial_id, True)


def test_a_relabel_while_the_loop_waits_answers_it(bench: Any, in_thread: Any) -> None:
    waiting = in_thread(bench.executed().await_label)
    bench.do("relabel", 1, outcome="success")
    assert waiting().label.outcome == "success"


def test_a_redo_keeps_the_old_take_flagged_and_costs_no_planned_trial(bench: Any) -> None:
    take = bench.executed()
    assert bench.do("redo", 1, cause="placement").status == "stored"
    assert take.await_label().kind == "redo"
    again = bench.begin()
    assert (again.trial_id, again.number) == (take.trial_id, 2)
    old = bench.trial(1).takes[0]
    assert (old.status, old.record, old.ended_because) == (
        "redone",
        "trials/1/trial.mcap",
        "placement",
    )
    assert bench.state.counts().planned == 3


def test_a_redo_needs_a_known_cause(bench: Any) -> None:
    bench.executed()
    assert "cause" in bench.do("redo", 1).message
    assert "cause" in bench.do("redo", 1, cause="bad mood").message


def test_an_undone_redo_restores_the_old_take(bench: Any, in_thread: Any) -> None:
    first = bench.executed()
    bench.do("redo", 1, cause="seeing")
    second = bench.begin()
    waiting = in_thread(second.wait_placed)
    assert bench.do("undo", 1).status == "stored"
    with pytest.raises(TakeEndedError):
        waiting()
    assert bench.begin().number == first.number
    assert bench.do("label", 1, outcome="success").status == "stored"


def test_a_redo_is_not_undone_once_the_next_take_sees(bench: Any) -> None:
    bench.executed()
    bench.do("redo", 1, cause="seeing")
    take = bench.begin()
    bench.do("placed", 1)
    take.advance(Phase.CAPTURE)
    assert "next take has begun" in bench.do("undo", 1).message


def test_a_skip_can_be_undone(bench: Any, in_thread: Any) -> None:
    waiting = in_thread(bench.begin().wait_placed)
    assert bench.do("skip", 1).status == "stored"
    with pytest.raises(TakeEndedError):
        waiting()
    assert bench.begin().trial_id == bench.trial(2).trial_id
    assert bench.state.counts().skipped == 1
    assert bench.do("undo", 1).status == "stored"
    assert bench.trial(1).status == "pending"


def test_an_operators_void_is_taken_again_and_can_be_undone(bench: Any) -> None:
    take = bench.executed()
    assert bench.do("void", 1, reason="wrong object").status == "stored"
    assert take.await_label().kind == "void"
    assert bench.state.counts().voided == 1
    assert bench.do("undo", 1).status == "stored"
    assert bench.trial(1).status == "unlabelled"


@pytest.mark.parametrize("kind", ["redo", "skip", "void"])
def test_nothing_ends_a_take_while_the_robot_moves(bench: Any, kind: str) -> None:
    take = bench.begin()
    bench.do("placed", 1)
    take.advance(Phase.EXECUTE)
    value = {"redo": {"cause": "moving"}, "void": {"reason": "x"}, "skip": {}}[kind]
    assert "robot is executing" in bench.do(kind, 1, **value).message


def test_the_operator_chooses_a_rival_pose(bench: Any, in_thread: Any) -> None:
    take = bench.begin()
    bench.do("placed", 1)
    take.advance(Phase.REGISTER)
    waiting = in_thread(lambda: take.confirm_pose({"rivals": [{}, {}]}))
    wait_for(bench, lambda: bench.trial(1).takes[0].phase is Phase.CONFIRM_POSE)
    assert "valid: 0 to 2" in bench.do("accept_pose", 1, rival=3).message
    assert bench.do("accept_pose", 1, rival=2).status == "stored"
    assert waiting() == 2


def test_the_operator_puts_an_ambiguous_object_down_again(bench: Any, in_thread: Any) -> None:
    take = bench.begin()
    bench.do("placed", 1)
    take.advance(Phase.REGISTER)
    waiting = in_thread(lambda: take.confirm_pose({"rivals": [{}]}))
    wait_for(bench, lambda: bench.trial(1).takes[0].phase is Phase.CONFIRM_POSE)
    assert bench.do("replace_object", 1).status == "stored"
    assert waiting() is None
    placing = in_thread(take.wait_placed)
    wait_for(bench, lambda: bench.trial(1).takes[0].phase is Phase.PLACE_OBJECT)
    assert bench.do("placed", 1).status == "stored"
    placing()


def test_who_saw_a_prediction_is_no_longer_blind(bench: Any) -> None:
    bench.labelled()
    bench.score(1, 0.9)
    bench.do("relabel", 1, outcome="failure", reason="missed")
    assert not bench.trial(1).label.blind
    assert bench.trial(1).takes[0].blind_label.outcome == "success"
    bench.do("relabel", 1, by=BOB, outcome="failure", reason="missed")
    assert bench.trial(1).label.blind
    bench.do("relabel", 1, by=BOB, outcome="success", found_by="disagreement")
    assert not bench.trial(1).label.blind


def test_a_second_label_never_replaces_the_first(bench: Any) -> None:
    bench.labelled()
    assert "another operator" in bench.do("second_label", 1, outcome="success").message
    value = {"outcome": "failure", "reason": "other"}
    assert bench.do("second_label", 1, by=BOB, **value).status == "stored"
    assert bench.trial(1).label.outcome == "success"
    assert bench.trial(1).takes[0].second_labels["bob"].outcome == "failure"


def test_a_second_operators_undo_is_an_event_and_touches_no_other_verdict(
    make_bench: Callable[..., Any],
) -> None:
    bench = make_bench()
    bench.labelled()
    take = bench.trial(1).takes[0]
    cy = Actor("cy", Source.OPERATOR)
    stale = bench.command("second_label", 1, outcome="success")
    bench.do("second_label", 1, by=BOB, outcome="success")
    assert bench.controller.submit(stale, BOB).status == "stale"
    bench.do("second_label", 1, by=cy, outcome="success")
    bench.do("second_label", 1, by=BOB, outcome="failure", reason="other")
    assert bench.do("undo_second", 1, by=BOB).status == "stored"
    assert take.second_labels["bob"].outcome == "success"  # the verdict before it holds again
    assert bench.do("undo_second", 1, by=BOB).status == "stored"
    assert set(take.second_labels) == {"cy"}
    assert "no second label" in bench.do("undo_second", 1, by=BOB).message
    assert bench.do("undo", 1).status == "stored"  # the first operator's own
    assert (take.label, set(take.second_labels)) == (None, {"cy"})
    bench.controller.close("ended")
    again = make_bench()  # the fold after a restart says the same
    assert set(again.trial(1).takes[0].second_labels) == {"cy"}
    assert again.state.last_second_verdict("cy")[0].trial_id == again.trial(1).trial_id
    assert again.state.last_second_verdict("bob") is None


def test_a_note_is_kept_with_its_trial_and_needs_a_text(bench: Any) -> None:
    assert bench.do("note", text="  ").status == "rejected"
    assert bench.do("note", 1, text="scratched pad").status == "stored"
    assert bench.trial(1).notes == ["scratched pad"]
