"""The session folder: whole or absent, and refused when the set-up changed."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

from logs.errors import NotASessionError, SessionChangedError, SessionExistsError
from logs.journal.events import Source
from logs.journal.file import JOURNAL_NAME, read_journal
from logs.journal.state import PlannedEntry, SessionState
from logs.session.folder import SESSION_NAME, SessionDescriptor, SessionFolder, open_segment

SETUP = {"robot": "r1", "camera": "c1", "calibration": "k1", "plan": "p1"}


@pytest.fixture
def descriptor() -> SessionDescriptor:
    trials = tuple(
        PlannedEntry(number=n, trial_id=f"id-{n}", grasp_id=f"g{n}", object_name="cube")
        for n in (1, 2, 3)
    )
    return SessionDescriptor(
        created_ns=5,
        seed=7,
        config={"station": {"name": "simulated"}},
        trials=trials,
        fingerprints=SETUP,
        simulated=True,
    )


@pytest.fixture
def folder(tmp_path: Path, descriptor: SessionDescriptor) -> SessionFolder:
    return SessionFolder.create(tmp_path / "s", descriptor, {"plan.json": "{}"})


def open_with(folder: SessionFolder, accept: tuple[str, ...] = (), **setup: str) -> SessionState:
    with folder.open_journal() as journal:
        state = SessionState.fold(folder.descriptor.trials, journal.entries)
        open_segment(
            journal, state, {**SETUP, **setup}, operator="a", source=Source.OPERATOR, accept=accept
        )
    return state


def test_a_created_folder_reads_back_exactly(
    folder: SessionFolder, descriptor: SessionDescriptor
) -> None:
    again = SessionFolder.open(folder.path)
    assert again.descriptor == descriptor
    assert again.plan_path.read_text() == "{}"
    assert again.read_state().counts().planned == 3
    assert sorted(path.name for path in folder.path.parent.iterdir()) == ["s"]


def test_nothing_is_overwritten(folder: SessionFolder, descriptor: SessionDescriptor) -> None:
    before = folder.journal_path.read_bytes()
    with pytest.raises(SessionExistsError, match="--resume"):
        SessionFolder.create(folder.path, descriptor)
    assert folder.journal_path.read_bytes() == before


def test_of_two_creators_at_once_one_wins(
    tmp_path: Path, descriptor: SessionDescriptor, monkeypatch: pytest.MonkeyPatch
) -> None:
    rename = os.rename

    def faster(source: Path, target: Path) -> None:
        monkeypatch.setattr(os, "rename", rename)
        target.mkdir()
        (target / SESSION_NAME).write_text("the other process")
        rename(source, target)

    monkeypatch.setattr(os, "rename", faster)
    with pytest.raises(SessionExistsError):
        SessionFolder.create(tmp_path / "s", descriptor)
    assert (tmp_path / "s" / SESSION_NAME).read_text() == "the other process"
    assert [path.name for path in tmp_path.iterdir()] == ["s"]


def test_a_kill_while_creating_leaves_nothing_or_a_session(
    tmp_path: Path, descriptor: SessionDescriptor
) -> None:
    (tmp_path / "d.json").write_text(descriptor.model_dump_json())
    script = """
import os, signal, sys
from pathlib import Path
from logs.session.folder import SessionDescriptor, SessionFolder
base, limit = Path(sys.argv[1]), int(sys.argv[2])
calls = 0
def counted(function):
    def call(*args):
        global calls
        calls += 1
        if calls == limit:
            os.kill(os.getpid(), signal.SIGKILL)
        return function(*args)
    return call
for name in ("fsync", "rename", "mkdir"):
    setattr(os, name, counted(getattr(os, name)))
SessionFolder.create(
    base / "s", SessionDescriptor.model_validate_json((base / "d.json").read_bytes()), {"plan.json": "{}"}
)
"""
    for limit in range(1, 12):
        done = subprocess.run([sys.executable, "-c", script, str(tmp_path), str(limit)])
        if done.returncode == 0:
            break
        if (tmp_path / "s").exists():
            assert SessionFolder.open(tmp_path / "s").descriptor == descriptor
            assert len(read_journal(tmp_path / "s" / JOURNAL_NAME)) == 1
            break
    assert limit > 4  # the kill hit several different moments before the folder appeared
    if not (tmp_path / "s").exists():
        SessionFolder.create(tmp_path / "s", descriptor)
    leftovers = [path for path in tmp_path.iterdir() if ".new-" in path.name]
    assert len(leftovers) <= 1  # each creation removes what killed ones left


def test_a_folder_without_session_json_is_named(tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    for path in (tmp_path, tmp_path / "nothing", tmp_path / "file"):
        with pytest.raises(NotASessionError) as refusal:
            SessionFolder.open(path)
        assert str(refusal.value) == f"{path} is no session folder (no session.json in it)"


def test_a_torn_descriptor_asks_for_a_copy(folder: SessionFolder) -> None:
    path = folder.path / SESSION_NAME
    path.write_bytes(path.read_bytes()[:100])
    with pytest.raises(NotASessionError, match="torn .*restore it from a copy.*trials/"):
        SessionFolder.open(folder.path)


def test_an_unreadable_descriptor_names_the_field(folder: SessionFolder) -> None:
    path = folder.path / SESSION_NAME
    content = json.loads(path.read_text())
    path.write_text(json.dumps({**content, "seed": "many"}))
    with pytest.raises(NotASessionError, match="seed"):
        SessionFolder.open(folder.path)


def test_a_session_of_another_version_is_refused_and_not_guessed_at(folder: SessionFolder) -> None:
    path = folder.path / SESSION_NAME
    content = json.loads(path.read_text())
    path.write_text(json.dumps({**content, "schema_version": 2}))
    with pytest.raises(NotASessionError, match="schema_version: Input should be 1"):
        SessionFolder.open(folder.path)


def test_a_trials_takes_have_folders_of_their_own(folder: SessionFolder) -> None:
    assert folder.trial_folder("id-2").name == "0002_id-2"
    assert folder.trial_folder("id-2", take=2).name == "0002_id-2_take2"


def test_the_same_set_up_continues_the_segment(folder: SessionFolder) -> None:
    assert open_with(folder).segment == 0
    assert open_with(folder).segment == 0


def test_a_changed_set_up_is_refused_by_name(folder: SessionFolder) -> None:
    open_with(folder)
    with pytest.raises(SessionChangedError, match="calibration .*--accept-change calibration"):
        open_with(folder, calibration="k2")
    with pytest.raises(SessionChangedError, match="camera.*robot"):
        open_with(folder, robot="r2", camera="c2")
    assert len(folder.read_state().segments) == 1


def test_an_accepted_change_opens_a_logged_segment(folder: SessionFolder) -> None:
    open_with(folder)
    open_with(folder, accept=("calibration",), calibration="k2")
    state = folder.read_state()
    assert state.segment == 1
    assert state.segments[-1].accepted == ("calibration",)
    assert open_with(folder, calibration="k2").segment == 1
    with pytest.raises(SessionChangedError):
        open_with(folder)


def test_accepting_one_change_does_not_accept_another(folder: SessionFolder) -> None:
    open_with(folder)
    with pytest.raises(SessionChangedError, match="robot") as caught:
        open_with(folder, accept=("calibration",), calibration="k2", robot="r2")
    assert set(caught.value.changed) == {"robot"}


def test_the_plan_never_changes(folder: SessionFolder) -> None:
    open_with(folder)
    with pytest.raises(SessionChangedError, match="never changes its plan"):
        open_with(folder, accept=("plan",), plan="p2")
