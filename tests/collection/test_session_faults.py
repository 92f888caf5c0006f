"""Scripted faults of the simulated station: each voids a take, none becomes a failed grasp."""

import json
from importlib import resources

import pytest

from collection.cli.main import main
from logs.journal.events import Voided
from logs.journal.file import read_journal
from logs.session.folder import SessionFolder


def station_with(folder, *faults):
    text = (
        resources.files("collection.station").joinpath("simulated.toml").read_text(encoding="utf-8")
    )
    for kind, attempt in faults:
        text += f'\n[[simulation.faults]]\nkind = "{kind}"\nattempt = {attempt}\n'
    path = folder / "faulty.toml"
    path.write_text(text)
    return path


def collect(station, out, repeats):
    words = f"--station {station} --objects cube_3cm --grasps 1 --repeats {repeats} --seed 8"
    options = f"--operator auto --out {out} --no-report --json"
    return main(["collect", *words.split(), *options.split()])


def voids(out):
    entries = read_journal(SessionFolder.open(out).journal_path)
    return [entry.event.reason for entry in entries if isinstance(entry.event, Voided)]


def test_faults_in_seeing_and_moving_void_the_take_and_it_is_taken_again(tmp_path, capsys):
    kinds = ["connection_lost", "collision_stop", "gripper_not_calibrated", "camera_timeout"]
    station = station_with(tmp_path, *((kind, n) for n, kind in enumerate(kinds, start=1)))
    assert collect(station, tmp_path / "S", repeats=1) == 0
    told = json.loads(capsys.readouterr().out)
    assert (told["planned"], told["labelled"]) == (1, 1)
    reasons = voids(tmp_path / "S")
    assert told["voided"] == len(reasons) >= len(kinds)
    expected = ["ConnectionLost", "CollisionStop", "GripperNotCalibrated", "CameraTimeout"]
    for name in expected:
        assert any(reason.startswith(name) for reason in reasons), (name, reasons)
    (trial,) = SessionFolder.open(tmp_path / "S").read_state().order
    assert trial.valid_take.take == len(reasons) + 1
    assert all(take.label is None for take in trial.takes[:-1])


def test_a_trial_that_cannot_be_tried_is_skipped_and_counted(tmp_path, capsys):
    station = station_with(tmp_path, *(("camera_timeout", n) for n in range(1, 9)))
    assert collect(station, tmp_path / "S", repeats=1) == 0
    told = json.loads(capsys.readouterr().out)
    assert (told["voided"], told["skipped"], told["labelled"]) == (8, 1, 0)
    assert told["successes"] == 0


def test_an_emergency_stop_ends_an_unattended_session_which_resumes(tmp_path, capsys):
    station = station_with(tmp_path, ("emergency_stop", 2))
    out = tmp_path / "S"
    assert collect(station, out, repeats=2) == 2
    captured = capsys.readouterr()
    assert "emergency stop" in captured.err.splitlines()[-1]
    state = SessionFolder.open(out).read_state()
    assert state.counts().labelled == 1
    assert state.closed.status == "failed"
    assert main(["collect", "--resume", "--out", str(out), "--no-report", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["labelled"] == 2


@pytest.mark.parametrize(
    ("change", "named"), [("closing_force = 20.0", "robot"), ("position = [0.80", "camera")]
)
def test_a_changed_station_is_not_resumed_silently(tmp_path, capsys, change, named):
    station = station_with(tmp_path, ("emergency_stop", 1))
    out = tmp_path / "S"
    assert collect(station, out, repeats=1) == 2
    changed = {"robot": "closing_force = 15.0", "camera": "position = [0.81"}[named]
    station.write_text(station.read_text().replace(change, changed))
    capsys.readouterr()
    assert main(["collect", "--resume", "--out", str(out), "--no-report"]) == 2
    line = capsys.readouterr().err.splitlines()[-1]
    assert named in line
    assert "--accept-change" in line
