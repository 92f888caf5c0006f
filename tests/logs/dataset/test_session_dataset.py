"""From a recorded session to labeled trials: what counts, what is left out, and why."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from logs.dataset.files import FORMATS, read_dataset, write_dataset
from logs.dataset.from_session import session_dataset
from logs.dataset.sources import load_labeled
from logs.errors import DatasetError, NotASessionError, UnknownFormatError
from logs.journal import events as ev
from logs.record.facts import read_facts
from logs.record.trial_record import read_record

OPERATOR = {"operator": "ada", "source": ev.Source.OPERATOR}


@pytest.fixture(scope="module")
def recorded(tmp_path_factory, sessions):
    return sessions.build_session(tmp_path_factory.mktemp("recorded") / "monday", count=4)


@pytest.fixture
def session(tmp_path, sessions):
    return sessions.build_session(tmp_path / "tuesday", count=3)


def test_trials_hold_what_the_records_say(recorded):
    dataset = session_dataset(recorded.path)
    assert dataset.name == "monday" and dataset.simulated
    assert [trial.number for trial in dataset.trials] == [1, 2, 3, 4]
    assert [trial.label.success for trial in dataset.trials] == [True, True, False, True]
    for trial in dataset.trials:
        record = read_record(recorded.path / trial.record, images=False)
        assert record.descriptor.trial_id == trial.trial_id
        for mine, theirs in [
            (trial.T_world_object, record.descriptor.T_world_object),
            (trial.T_object_gripper, record.descriptor.planned.T_object_gripper),
            (trial.execution.T_world_object, record.registration.T_world_object),
            (trial.execution.covariance, record.registration.covariance),
            (trial.execution.T_world_gripper, record.execution.T_world_gripper),
        ]:
            np.testing.assert_array_equal(mine, theirs)
        assert trial.opening == 0.04 and trial.force == 20.0
        assert trial.execution.jaw_force == 19.6 and trial.execution.sensor_verdict == "held"
        assert set(trial.scores) == {"point", "reach"}
        assert trial.label.source == "operator_sim"
    third = dataset.trials[2]
    assert third.label.reason == "slipped_on_lift"
    assert dataset.objects["bracket"].mass == 0.02
    assert dataset.gripper.name == "yumi"


def test_what_does_not_count_is_named(recorded):
    (row,) = session_dataset(recorded.path).left_out
    assert (row.number, row.reason) == (5, "not executed")


def test_quick_reading_and_whole_reading_agree(recorded):
    paths = sorted(recorded.trials.glob("*/trial.mcap"))
    for facts, path in zip(read_facts(paths), paths, strict=True):
        record = read_record(path, images=False)
        assert facts.descriptor.trial_id == record.descriptor.trial_id
        np.testing.assert_array_equal(facts.registration.covariance, record.registration.covariance)
        assert facts.execution.time_ns == record.execution.time_ns
        vertices, faces = facts.mesh
        assert len(vertices) == 8 and len(faces) == 12


def test_a_record_without_its_summary_is_read_whole(session):
    path = next(iter(sorted(session.trials.glob("*/trial.mcap"))))
    whole = read_facts([path])[0]
    path.write_bytes(path.read_bytes()[:-40])
    cut = read_facts([path])[0]
    assert cut.sha256 != whole.sha256
    np.testing.assert_array_equal(cut.execution.T_world_gripper, whole.execution.T_world_gripper)


@pytest.mark.parametrize("harm", [Path.unlink, lambda path: path.write_bytes(b"no record")])
def test_one_lost_record_does_not_lock_the_others_away(session, tmp_path, harm):
    whole = session_dataset(session.path)
    harm(session.path / whole.trials[0].record)
    rest = session_dataset(session.path)
    assert [t.trial_id for t in rest.trials] == [t.trial_id for t in whole.trials[1:]]
    lost = [row for row in rest.left_out if row.trial_id == whole.trials[0].trial_id]
    assert [row.reason for row in lost] == ["labeled, but its record is missing or damaged"]
    write_dataset(rest, tmp_path / "D", ["csv"])
    assert lost[0].reason in (tmp_path / "D/README.md").read_text()


def test_a_record_of_a_later_release_is_refused_and_not_left_out(tmp_path, sessions, monkeypatch):
    monkeypatch.setattr("logs.record.encode.FORMAT_VERSION", 99)
    later = sessions.build_session(tmp_path / "later", count=1)
    with pytest.raises(UnknownFormatError, match="record format 99"):
        session_dataset(later.path)


def journal_after(session, *events):
    with session.open_journal() as journal:
        for event in events:
            journal.append(event)


def test_redo_void_skip_and_relabel(session):
    first, second, third = (trial.trial_id for trial in session.descriptor.trials[:3])
    fresh = session.read_state().trials[first].takes[0].record
    journal_after(
        session,
        ev.Redone(trial_id=first, take=1, cause=ev.RedoCause.PLACEMENT, **OPERATOR),
        ev.TrialStarted(trial_id=first, take=2),
        ev.Voided(trial_id=first, take=2, reason="NoGoodPoseError: nothing fits (0.31)"),
        ev.TrialStarted(trial_id=first, take=3),
        ev.Executed(trial_id=first, take=3, record=fresh, sensor=ev.SensorVerdict(lifted=False)),
        ev.Labelled(
            trial_id=first,
            take=3,
            outcome=ev.Outcome.FAILURE,
            reason=ev.FailureReason.MISSED,
            **OPERATOR,
        ),
        ev.Skipped(trial_id=second, **OPERATOR),
        ev.Relabelled(trial_id=third, take=1, outcome=ev.Outcome.SUCCESS, **OPERATOR),
    )
    dataset = session_dataset(session.path)
    redone, relabeled = dataset.trials
    assert redone.takes == 3 and not redone.label.success
    assert redone.redos == ("placement",) and redone.redo_outcomes == ("lifted",)
    assert redone.voids == ("NoGoodPoseError",)
    assert relabeled.label.success and relabeled.label.relabeled == 1
    assert relabeled.label.operator == "ada"
    assert {row.reason for row in dataset.left_out} == {"skipped", "not executed"}


def test_an_unblinded_relabel_counts_only_when_asked_for(session):
    third = session.descriptor.trials[2].trial_id
    journal_after(
        session,
        ev.Relabelled(
            trial_id=third,
            take=1,
            outcome=ev.Outcome.SUCCESS,
            blind=False,
            found_by="disagreement",
            **OPERATOR,
        ),
    )
    kept = session_dataset(session.path)
    assert not kept.trials[2].label.success
    assert "1 relabels were given after a prediction had been seen" in kept.notes[0]
    taken = session_dataset(session.path, unblinded=True)
    assert taken.trials[2].label.success and not taken.trials[2].label.blind


def test_same_session_same_bytes_and_two_sessions_join(session, recorded, tmp_path):
    for name in ("a", "b"):
        write_dataset(session_dataset(session.path), tmp_path / name, FORMATS)
    files = [
        {p.relative_to(tmp_path / n): p.read_bytes() for p in (tmp_path / n).rglob("*.*")}
        for n in ("a", "b")
    ]
    assert files[0] == files[1]
    again = read_dataset(tmp_path / "a")
    assert [t.trial_id for t in again.trials] == [
        t.trial_id for t in session_dataset(session.path).trials
    ]
    with pytest.raises(DatasetError, match="trial id twice"):
        load_labeled([session.path, recorded.path])  # copies of one made-up session


def test_station_errors_add_to_the_registrations_own(session):
    plain = session_dataset(session.path).pose_error
    assert session_dataset(session.path).trials[0].execution.covariance_in_hand is None
    path = session.path / "session.json"
    content = json.loads(path.read_text())
    content["config"] = {
        "station": {
            "pose_error": {
                "calibration_translation": 3e-3,
                "actuation_translation": 4e-3,
                "calibration_rotation": 0.0,
                "actuation_rotation": 0.0,
            }
        }
    }
    path.write_text(json.dumps(content))
    trials = session_dataset(session.path).trials
    stated = session_dataset(session.path).pose_error
    for trial in trials:
        added = trial.execution.covariance_in_hand - trial.execution.covariance
        np.testing.assert_allclose(np.diag(added), [0, 0, 0, 25e-6, 25e-6, 25e-6], rtol=1e-9)
    assert stated.translation == pytest.approx(np.hypot(plain.translation, 5e-3), rel=0.05)
    assert stated.rotation == plain.rotation
    for value in (stated.translation, stated.rotation):
        assert value == float(f"{value:.1e}")  # two digits: one more trial keeps cached scores


def test_an_empty_session_is_refused_in_one_line(tmp_path, sessions):
    folder = sessions.make_session(tmp_path / "empty", 3)
    refusal = "no trial that counts; left out: 3 not executed"
    with pytest.raises(DatasetError, match=refusal):
        load_labeled([folder.path])
    with pytest.raises(DatasetError, match=refusal):
        write_dataset(session_dataset(folder.path), tmp_path / "out")
    (folder.path / "session.json").write_text("{}")
    with pytest.raises(NotASessionError):
        load_labeled([folder.path])


def test_dataset_refuses_a_repeated_trial(recorded):
    dataset = session_dataset(recorded.path)
    with pytest.raises(DatasetError, match="twice"):
        replace(dataset, trials=dataset.trials * 2)


def test_a_plan_is_lifted_to_the_stations_table(session):
    flat = session_dataset(session.path)
    path = session.path / "session.json"
    content = json.loads(path.read_text())
    content["config"] = {"station": {"workspace": {"table_height": -0.012}}}
    path.write_text(json.dumps(content))
    low = session_dataset(session.path)
    assert flat.trials[0].table_height == 0.0 and low.trials[0].table_height == -0.012
    np.testing.assert_allclose(
        low.trials[0].T_world_object[:3, 3],
        flat.trials[0].T_world_object[:3, 3] + (0, 0, -0.012),
        atol=1e-15,
    )
    assert low.cases()[0].scene.table_height == -0.012


def test_trials_know_the_segment_they_were_run_in(tmp_path, sessions):
    session = sessions.build_session(tmp_path / "wednesday", count=2)
    second = session.descriptor.trials[1].trial_id
    record = session.read_state().trials[second].takes[0].record
    journal_after(
        session,
        ev.SessionOpened(segment=1, fingerprints={}, accepted=("calibration",), **OPERATOR),
        ev.Redone(trial_id=second, take=1, cause=ev.RedoCause.PLACEMENT, **OPERATOR),
        ev.TrialStarted(trial_id=second, take=2),
        ev.Executed(trial_id=second, take=2, record=record, sensor=ev.SensorVerdict(lifted=True)),
        ev.Labelled(trial_id=second, take=2, outcome=ev.Outcome.SUCCESS, **OPERATOR),
    )
    assert [trial.segment for trial in session_dataset(session.path).trials] == [0, 1]
