"""Labels appear as annotation files; whoever labels waits for the journal only."""

from __future__ import annotations

import threading
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from logs.errors import JournalWriteError
from logs.journal.events import (
    Executed,
    Labelled,
    Outcome,
    Scored,
    SecondLabelled,
    SensorVerdict,
    Source,
    Undone,
)
from logs.journal.file import read_journal
from logs.journal.state import PlannedEntry
from logs.record.annotation_files import read_annotations
from logs.session.folder import SessionDescriptor, SessionFolder
from logs.session.mirror import AnnotationMirror
from logs.session.mirrored_journal import MirroredJournal

LABEL = Labelled(
    trial_id="t1", take=1, outcome=Outcome.SUCCESS, operator="ann", source=Source.OPERATOR
)
SCORE = Scored(trial_id="t1", take=1, model="point", version="1", value=0.5)


@pytest.fixture
def folder(tmp_path: Path) -> SessionFolder:
    planned = PlannedEntry(number=1, trial_id="t1", grasp_id="g1", object_name="cube")
    described = SessionDescriptor(
        created_ns=1, seed=1, config={}, trials=(planned,), fingerprints={}, simulated=True
    )
    return SessionFolder.create(tmp_path / "S", described)


@pytest.fixture
def journal(folder: SessionFolder) -> Iterator[MirroredJournal]:
    stored = folder.open_journal()
    journal = MirroredJournal(stored, AnnotationMirror(folder, stored.entries))
    journal.append(
        Executed(trial_id="t1", take=1, record="trial.mcap", sensor=SensorVerdict(lifted=True))
    )
    yield journal
    journal.close()


def test_a_label_and_its_withdrawal_get_files_and_a_score_is_left_to_its_maker(
    folder: SessionFolder, journal: MirroredJournal
) -> None:
    take = folder.trial_folder("t1")
    take.mkdir()
    labelled = journal.append(LABEL)
    journal.append(SCORE)
    journal.wait_mirrored()
    found = read_annotations(take)
    assert [label.event_id for label in found.labels] == [str(labelled.seq)]
    assert found.label is not None and not found.scores
    journal.append(
        Undone(trial_id="t1", undoes=labelled.seq, operator="ann", source=Source.OPERATOR)
    )
    journal.wait_mirrored()
    assert read_annotations(take).label is None


def test_a_second_verdict_and_its_withdrawal_get_files(
    folder: SessionFolder, journal: MirroredJournal
) -> None:
    take = folder.trial_folder("t1")
    take.mkdir()
    given = journal.append(
        SecondLabelled(**{**LABEL.model_dump(exclude={"kind"}), "operator": "bo"})
    )
    journal.append(Undone(trial_id="t1", undoes=given.seq, operator="bo", source=Source.OPERATOR))
    journal.wait_mirrored()
    second, withdrawal = read_annotations(take).labels
    assert (second.second, second.operator) == (True, "bo")
    assert withdrawal.withdraws == str(given.seq)


def test_a_label_is_stored_while_its_file_still_waits(
    folder: SessionFolder, journal: MirroredJournal, monkeypatch: Any
) -> None:
    begun, go_on = threading.Event(), threading.Event()

    def slow(_entry: object) -> None:
        begun.set()
        go_on.wait(60)

    monkeypatch.setattr(journal.mirror, "note", slow)
    entry = journal.append(LABEL)
    assert begun.wait(60)
    assert read_journal(folder.journal_path)[-1] == entry
    go_on.set()


def test_what_cannot_be_written_beside_stops_nothing(
    folder: SessionFolder, journal: MirroredJournal
) -> None:
    journal.append(LABEL)  # the take's folder is missing
    journal.wait_mirrored()
    folder.trial_folder("t1").mkdir()
    journal.append(LABEL)
    journal.wait_mirrored()
    assert len(read_annotations(folder.trial_folder("t1")).labels) == 1


def test_closing_finishes_the_files_and_lets_another_writer_in(
    folder: SessionFolder, journal: MirroredJournal
) -> None:
    folder.trial_folder("t1").mkdir()
    journal.append(LABEL)
    journal.close()
    journal.close()
    assert len(read_annotations(folder.trial_folder("t1")).labels) == 1
    with pytest.raises(JournalWriteError):
        journal.append(LABEL)
    with folder.open_journal():
        pass
