"""A station that was calibrated again between two sittings: refused, or accepted in the open."""

import json
from importlib import resources

import pytest

from collection.cli.main import main
from logs.journal.events import SessionOpened
from logs.journal.file import read_journal
from logs.session.folder import SessionFolder

BEFORE, AFTER = "calibration_offset = 0.0005", "calibration_offset = 0.0004"
FAULT = '\n[[simulation.faults]]\nkind = "emergency_stop"\nattempt = 2\n'


def resume(out, *extra):
    return main(["collect", "--resume", "--out", str(out), "--no-report", "--json", *extra])


def opened(out):
    entries = read_journal(SessionFolder.open(out).journal_path)
    return [entry.event for entry in entries if isinstance(entry.event, SessionOpened)]


@pytest.fixture
def half_done(tmp_path, capsys):
    """A session with one trial of two done, whose station was calibrated again since."""
    text = (
        resources.files("collection.station").joinpath("simulated.toml").read_text(encoding="utf-8")
    )
    station, out = tmp_path / "lab.toml", tmp_path / "S"
    assert BEFORE in text
    station.write_text(text + FAULT)
    words = "--objects cube_3cm --grasps 1 --repeats 2 --seed 8 --models point --operator auto"
    ended = main(
        ["collect", "--station", str(station), *words.split(), "--out", str(out), "--no-report"]
    )
    assert ended == 2
    assert "emergency stop" in capsys.readouterr().err
    station.write_text(text.replace(BEFORE, AFTER))
    return out


def test_an_accepted_calibration_opens_a_new_segment_and_its_trials_belong_to_it(half_done, capsys):
    for extra in ([], ["--accept-change", "camera"]):
        assert resume(half_done, *extra) == 2
        (line,) = capsys.readouterr().err.strip().splitlines()
        assert "calibration (was " in line and "--accept-change calibration" in line
    assert len(opened(half_done)) == 1

    assert resume(half_done, "--accept-change", "calibration") == 0
    assert json.loads(capsys.readouterr().out)["labelled"] == 2
    first, second = opened(half_done)
    assert (first.segment, first.accepted) == (0, ())
    assert (second.segment, second.accepted) == (1, ("calibration",))
    changed = {k for k in first.fingerprints if first.fingerprints[k] != second.fingerprints[k]}
    assert changed == {"calibration"}
    takes = [trial.valid_take for trial in SessionFolder.open(half_done).read_state().order]
    assert [take.segment for take in takes] == [0, 1]

    assert resume(half_done) == 0  # what was accepted is the session's set-up from now on
    assert opened(half_done)[-1].segment == 1
