"""After a crash: save unfinished records, and bring journal, records and index together.

Nothing is deleted and no label is invented. Whatever does not fit is told, loudly, as a finding.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

from logs.errors import RecordReadError
from logs.journal import events as ev
from logs.journal.events import Entry
from logs.journal.file import Journal, scan_journal
from logs.journal.repair import JournalRepair, repair_journal
from logs.journal.state import SessionState, TakeState
from logs.record.annotation_files import read_annotations
from logs.record.records import Severity
from logs.record.salvage import Salvage, salvage
from logs.record.trial_record import TrialRecord, read_record, record_path
from logs.session.folder import SessionFolder
from logs.session.index import rebuild_index
from logs.session.mirror import AnnotationMirror
from logs.trial_folder import RECORD_NAME, folder_identity, take_folders

_LIFTED = {"held": True, "empty": False, "lost": False}
_EXECUTED = ("executed", "redone", "voided")


@dataclass(frozen=True, slots=True)
class Finding:
    """One thing that recovery did or could not do.

    Args:
        severity: info (done, nothing lost), warning (something is lost or odd), error (a person
            must look).
        place: file or folder, relative to the session.
        text: what was found and what was done.
    """

    severity: Severity
    place: str
    text: str


@dataclass(frozen=True, slots=True)
class RecoveryReport:
    """What recovery found; empty if all was well."""

    findings: tuple[Finding, ...]
    takes: int

    @property
    def clean(self) -> bool:
        """Nothing was out of order."""
        return not self.findings


def recover_session(path: Path, clock: Callable[[], int] = time.time_ns) -> RecoveryReport:
    """Repair a session's folder; harmless on a healthy one, and when called again.

    Args:
        path: the session's folder.
        clock: nanoseconds since the epoch, for the events that are added.

    Raises:
        NotASessionError: if it is none.
        SessionLockedError: if a process is recording into it.
        RecordWriteError: if the disk is full.
    """
    folder = SessionFolder.open(path)
    findings: list[Finding] = []
    with folder.lock():
        findings += _mend_journal(folder, clock)
        findings += _save_records(folder)
    with folder.open_journal(clock=clock) as journal:
        findings += _Reconciliation(folder, journal).run()
    rebuild_index(folder)
    return RecoveryReport(tuple(findings), len(take_folders(path)))


def _mend_journal(folder: SessionFolder, clock: Callable[[], int]) -> Iterator[Finding]:
    name = folder.journal_path.name
    mended = repair_journal(folder.journal_path, clock)
    if mended is not None:
        yield Finding(Severity.ERROR, name, _mended_text(mended))
    if scan_journal(folder.journal_path).torn:
        yield Finding(
            Severity.WARNING, name, "the last line was never finished; it is kept in events.torn"
        )


def _mended_text(mended: JournalRepair) -> str:
    lost = ", ".join(map(str, mended.lost)) or "none"
    problems = "; ".join(mended.problems) or "lines are missing"
    doubtful = f"; trials in doubt, label again: {len(mended.touched)}" if mended.touched else ""
    return f"{problems}; events lost: {lost}; kept in {mended.aside.name}{doubtful}"


def _save_records(folder: SessionFolder) -> Iterator[Finding]:
    for take in take_folders(folder.path):
        saved = salvage(take)
        if saved is not None:
            yield _saved_finding(folder.path, saved)


def _saved_finding(session: Path, saved: Salvage) -> Finding:
    place = str(saved.folder.relative_to(session))
    kept = f"the original is {saved.original.name}"
    if saved.record is None:
        text = f"unfinished record without a readable beginning ({saved.damage}); {kept}"
        return Finding(Severity.WARNING, place, text)
    if saved.stopped:
        text = f"unfinished record saved whole, {saved.messages} messages; {kept}"
        return Finding(Severity.INFO, place, text)
    text = f"unfinished record saved up to its last flush, {saved.messages} messages; {kept}"
    return Finding(Severity.WARNING, place, text)


class _Reconciliation:
    """Compares the journal with the takes' folders, and adds to either what it lacks."""

    def __init__(self, folder: SessionFolder, journal: Journal) -> None:
        self._folder = folder
        self._journal = journal
        self._entries: list[Entry] = list(journal.entries)
        self._state = SessionState.fold(folder.descriptor.trials, self._entries)
        self._lost = {
            str(seq)
            for entry in self._entries
            if isinstance(entry.event, ev.JournalRepaired)
            for seq in entry.event.lost
        }

    def run(self) -> Iterator[Finding]:
        for path in take_folders(self._folder.path):
            yield from self._check_folder(path)
        yield from self._missing_records()
        yield from self._missing_annotations()

    def _finding(self, severity: Severity, path: Path, text: str) -> Finding:
        return Finding(severity, str(path.relative_to(self._folder.path)), text)

    def _check_folder(self, path: Path) -> Iterator[Finding]:
        identity = folder_identity(path)
        if identity is None or identity[1] not in self._state.trials:
            yield self._finding(Severity.ERROR, path, "no trial of the plan has this id")
            return
        if not (path / RECORD_NAME).exists():
            yield self._finding(Severity.WARNING, path, "no record in this folder")
            return
        try:
            record = read_record(record_path(path), images=False)
        except RecordReadError as error:
            yield self._finding(Severity.ERROR, path, str(error))
            return
        if record.damage:
            yield self._finding(Severity.ERROR, path, f"the record is damaged: {record.damage}")
        described = record.descriptor
        if (described.trial_id, described.take) != identity[1:]:
            text = f"the record is of trial {described.trial_id}, take {described.take}"
            yield self._finding(Severity.ERROR, path, text)
            return
        yield from self._adopt(path, record)
        yield from self._doubtful_labels(path, record)

    def _adopt(self, path: Path, record: TrialRecord) -> Iterator[Finding]:
        """Tell the journal of an executed take that it does not know."""
        described = record.descriptor
        take = self._take(described.trial_id, described.take)
        if not record.executed or (take is not None and take.status in _EXECUTED):
            return
        execution = record.execution
        verdict = execution.sensor_verdict if execution else "unknown"
        width = execution.measurements.get("width") if execution else None
        self._append(
            ev.Executed(
                trial_id=described.trial_id,
                take=described.take,
                record=str(record.path.relative_to(self._folder.path)),
                sensor=ev.SensorVerdict(lifted=_LIFTED.get(verdict), jaw_width=width),
                recovered=True,
            )
        )
        text = "executed, but the journal did not know; it needs a label"
        yield self._finding(Severity.WARNING, path, text)

    def _doubtful_labels(self, path: Path, record: TrialRecord) -> Iterator[Finding]:
        """A label whose line in the journal is lost is asked for again, not taken on trust."""
        annotations = read_annotations(path)
        for damaged, why in annotations.damaged:
            yield self._finding(Severity.WARNING, damaged, f"damaged annotation: {why}")
        trial = self._state.trials[record.descriptor.trial_id]
        known = [entry.seq for take in trial.takes for entry, _ in take.labels]
        doubtful = [
            label.event_id
            for label in annotations.labels
            if label.event_id in self._lost and label.revision > max(known, default=0)
        ]
        if not doubtful or trial.needs_label:
            return
        why = f"the journal lost events {', '.join(doubtful)}, which labeled this trial"
        self._append(ev.NeedsLabel(trial_id=trial.trial_id, why=why))
        yield self._finding(Severity.ERROR, path, f"{why}; it needs a label")

    def _missing_records(self) -> Iterator[Finding]:
        for trial in self._state.order:
            for take in trial.takes:
                if take.record is None or (self._folder.path / take.record).exists():
                    continue
                text = f"trial {trial.planned.number}: the journal names this record; it is missing"
                yield Finding(Severity.ERROR, take.record, text)

    def _missing_annotations(self) -> Iterator[Finding]:
        known: dict[Path, frozenset[str]] = {}
        mirror = AnnotationMirror(self._folder)
        for entry in self._entries:
            annotation = mirror.annotation(entry)
            if annotation is None or annotation.trial_id not in self._state.trials:
                continue
            folder = self._folder.trial_folder(annotation.trial_id, annotation.take)
            if not folder.is_dir():
                continue  # told already, as a missing record
            if folder not in known:
                known[folder] = read_annotations(folder).event_ids
            if annotation.event_id not in known[folder]:
                written = mirror.note(entry)
                if written is not None:
                    text = f"event {entry.seq} of the journal had no annotation; written again"
                    yield self._finding(Severity.INFO, written, text)

    def _take(self, trial_id: str, number: int) -> TakeState | None:
        takes = self._state.trials[trial_id].takes
        return takes[number - 1] if number <= len(takes) else None

    def _append(self, event: ev.AnyEvent) -> None:
        entry = self._journal.append(event)
        self._entries.append(entry)
        self._state.apply(entry)
