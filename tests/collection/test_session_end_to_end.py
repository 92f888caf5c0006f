"""One real simulated session, run as a user runs it, and everything that must be true of it."""

import json
import shutil
import subprocess
import sys
import time
from pathlib import Path

import pytest

from collection.cli.main import main
from logs.journal.events import Executed, Labelled, Scored, Source
from logs.journal.file import read_journal
from logs.record.trial_record import read_record
from logs.session.folder import SessionFolder
from reach.models.names import ANALYTIC_NAMES

REACH = Path(sys.executable).with_name("reach")
OBJECTS, GRASPS, REPEATS = "cube_3cm,bracket", 2, 1
MODELS = set(ANALYTIC_NAMES)


def command(out, *extra):
    return [
        "collect", "--station", "simulated", "--objects", OBJECTS, "--grasps", str(GRASPS),
        "--repeats", str(REPEATS), "--operator", "auto", "--seed", "11", "--out", str(out),
        "--no-report", *extra,
    ]  # fmt: skip


@pytest.fixture(scope="module")
def session(tmp_path_factory):
    out = tmp_path_factory.mktemp("sessions") / "S"
    done = subprocess.run(
        [REACH, *command(out, "--json")], capture_output=True, text=True, timeout=280
    )
    assert done.returncode == 0, done.stderr
    return out, json.loads(done.stdout)


def test_every_planned_trial_is_labelled_and_scored(session):
    out, summary = session
    planned = 2 * GRASPS * REPEATS
    assert summary["planned"] == summary["labelled"] == planned
    assert summary["unlabelled"] == 0
    assert summary["simulated"] is True
    total = summary["objects"][-1]
    assert total["trials"] == planned
    assert set(total["predictions"]) == MODELS
    assert all(0 <= value <= 1 for value in total["predictions"].values())


def test_labels_are_marked_as_simulated_and_follow_execution(session):
    out, _ = session
    entries = read_journal(SessionFolder.open(out).journal_path)
    executed = {e.event.trial_id: e.seq for e in entries if isinstance(e.event, Executed)}
    labels = [e for e in entries if isinstance(e.event, Labelled)]
    assert labels
    for entry in labels:
        assert entry.event.source is Source.OPERATOR_SIM
        assert entry.event.blind
        assert executed[entry.event.trial_id] < entry.seq


def test_no_prediction_existed_before_its_label(session):
    out, _ = session
    entries = read_journal(SessionFolder.open(out).journal_path)
    labelled = {e.event.trial_id: e.seq for e in entries if isinstance(e.event, Labelled)}
    scores = [e for e in entries if isinstance(e.event, Scored)]
    assert {e.event.model for e in scores} == MODELS
    assert len(scores) >= len(labelled) * len(MODELS)
    assert all(labelled[e.event.trial_id] < e.seq for e in scores)


def test_records_hold_the_whole_trial(session):
    out, _ = session
    for trial in SessionFolder.open(out).read_state().order:
        record = read_record((out / trial.valid_take.record).parent)
        assert record.complete
        assert record.executed
        assert record.descriptor.trial_id == trial.trial_id
        assert record.descriptor.simulated
        assert record.registration is not None
        assert record.execution is not None
        assert len(record.depth) == 1
        assert len(record.jaw.time_ns) > 50
        assert {"object.ply", "gripper.json", "robot.json", "station.toml"} <= set(
            record.attachments
        )
        error = record.execution.measurements["true_registration_error_translation"]
        assert 0 < error < 5e-3, "registration found the object where it is"
        assert (out / trial.valid_take.record).with_name("trial.rrd").exists()


def test_the_jaws_close_and_the_sensors_agree_with_the_label_mostly(session):
    out, _ = session
    state = SessionFolder.open(out).read_state()
    agree = [
        trial.valid_take.sensor.lifted == (trial.label.outcome == "success")
        for trial in state.order
    ]
    assert sum(agree) >= len(agree) - 1  # two verdicts, two instruments


def test_status_tells_the_same_as_the_journal(session, capsys):
    out, _ = session
    assert main(["status", str(out), "--json"]) == 0
    status = json.loads(capsys.readouterr().out)
    assert status["planned"] == status["labelled"] == status["done"]
    assert status["disk_left"] > 0


def test_scoring_again_adds_events_and_changes_no_label(session, capsys):
    out, _ = session
    before = SessionFolder.open(out).read_state()
    assert main(["score", str(out), "--models", "point", "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert told["scored_takes"] == {str(out): len(before.order)}
    after = SessionFolder.open(out).read_state()
    assert after.seq == before.seq + len(before.order)
    assert [t.label for t in after.order] == [t.label for t in before.order]
    assert main(["score", str(out), "--models", "pointy"]) == 2
    assert "pointy" in capsys.readouterr().err
    assert SessionFolder.open(out).read_state().seq == after.seq


def test_a_torn_record_keeps_no_other_from_being_scored_and_recovery_tells_it(
    session, tmp_path, capsys
):
    out = tmp_path / "S"
    shutil.copytree(session[0], out)
    assert main(["recover", str(out)]) == 0
    trials = SessionFolder.open(out).read_state().order
    record = out / trials[1].valid_take.record
    record.write_bytes(record.read_bytes()[:500])
    capsys.readouterr()
    assert main(["score", str(out), "--models", "point", "--json"]) == 0
    told = capsys.readouterr()
    assert json.loads(told.out)["scored_takes"] == {str(out): len(trials) - 1}
    assert f"not scored: {record.parent.parent}" in told.err and record.parent.name in told.err
    assert main(["recover", str(out)]) == 1
    assert "ERROR" in capsys.readouterr().out


def test_the_report_shows_what_the_plan_covers(session, tmp_path, capsys):
    out, _ = session
    page = tmp_path / "report.html"
    assert main(["report", str(out), "--out", str(page), "--models", "point", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["report"] == str(page)
    text = page.read_text()
    assert f"{2 * GRASPS} planned grasps" in text
    assert "jitter offset" in text
    assert "Simulated: 4 of 4 trials" in text


def test_a_further_session_plans_other_trials(session, capsys):
    out, _ = session
    words = ["collect", "--objects", OBJECTS, "--grasps", "2", "--repeats", "1", "--seed", "11"]
    assert main([*words, "--session", "1", "--out", "unused", "--dry-run", "--json"]) == 0
    further = {trial["trial_id"] for trial in json.loads(capsys.readouterr().out)["trials"]}
    first = {trial["trial_id"] for trial in json.loads((out / "plan.json").read_text())["trials"]}
    assert len(further) == len(first)
    assert not further & first


def test_resuming_a_finished_session_changes_no_trial(session):
    out, _ = session
    before = SessionFolder.open(out).read_state()
    assert main(["collect", "--resume", "--out", str(out), "--no-report", "--json"]) == 0
    after = SessionFolder.open(out).read_state()
    assert [t.label for t in after.order] == [t.label for t in before.order]


def test_the_same_seed_plans_and_places_the_same(session, tmp_path):
    out, _ = session
    again = tmp_path / "again"
    process = subprocess.Popen(
        [REACH, *command(again)], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
    )
    try:
        wait_for(lambda: executed_records(again), process)
    finally:
        process.kill()
        process.wait()
    assert (again / "plan.json").read_text() == (out / "plan.json").read_text()
    one = executed_records(again)[0]
    first, second = read_record((again / one).parent), read_record((out / one).parent)
    assert first.descriptor.seed == second.descriptor.seed
    assert (first.depth[0].depth == second.depth[0].depth).sum() > 0.9 * first.depth[0].depth.size


def executed_records(out):
    if not (out / "session.json").exists():
        return []
    entries = read_journal(SessionFolder.open(out).journal_path)
    return [e.event.record for e in entries if isinstance(e.event, Executed)]


def wait_for(condition, process, seconds=200):
    deadline = time.monotonic() + seconds
    while not condition():
        assert process.poll() is None, "the session ended early"
        assert time.monotonic() < deadline, "nothing happened in time"
        time.sleep(0.1)
