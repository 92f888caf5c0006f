"""The journal's labels and scores as annotation files beside the records.

The journal is written first and is the truth; these files follow. What is missing, because the
process was killed in between, recovery writes later.
"""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping
from pathlib import Path

from logs.journal import events as ev
from logs.journal.events import Entry
from logs.record.annotation_files import write_annotation
from logs.record.annotations import ALL_LABELS, LabelRecord, PatchRecord, ScoreRecord
from logs.session.folder import SessionFolder


class AnnotationMirror:
    """Turns a journal's entries into annotation files, one by one and in their order.

    Args:
        folder: the session.
        entries: what the journal held before; nothing is written for them.
    """

    def __init__(self, folder: SessionFolder, entries: Iterable[Entry] = ()) -> None:
        self._folder = folder
        self._takes: dict[int, int] = {}
        self._newest_take: dict[str, int] = {}
        for entry in entries:
            self._remember(entry)

    def note(
        self,
        entry: Entry,
        *,
        patches: tuple[PatchRecord, ...] = (),
        parameters: Mapping[str, str] | None = None,
        seconds: float = 0.0,
        explanation: str = "",
    ) -> Path | None:
        """Write the file of an entry that was just stored.

        Args:
            entry: any entry of the journal; most have no file.
            patches: a score's predicted contacts.
            parameters: of the score's model.
            seconds: what the score took.
            explanation: of the score, in words.

        Returns:
            The new file, or None if the entry is neither label nor score.

        Raises:
            RecordWriteError: if the take's folder is missing or the disk fails.
        """
        found = self.annotation(entry)
        if found is None:
            return None
        if isinstance(found, ScoreRecord):
            found = ScoreRecord(
                trial_id=found.trial_id,
                take=found.take,
                time_ns=found.time_ns,
                event_id=found.event_id,
                revision=found.revision,
                model=found.model,
                version=found.version,
                value=found.value,
                seconds=seconds,
                parameters=dict(parameters or {}),
                explanation=explanation,
                details=found.details,
                texts=found.texts,
                patches=patches,
            )
        return write_annotation(self._folder.trial_folder(found.trial_id, found.take), found)

    def annotation(self, entry: Entry) -> LabelRecord | ScoreRecord | None:
        """What the file of an entry says; None if it has none. Call it in the journal's order."""
        self._remember(entry)
        event = entry.event
        match event:
            case ev.Labelled() | ev.Relabelled() | ev.SecondLabelled():
                return _label(entry, event)
            case ev.Scored():
                return _score(entry, event)
            case ev.Undone() if event.undoes in self._takes:
                return _withdrawal(entry, event.trial_id, self._takes[event.undoes], event.undoes)
            case ev.NeedsLabel() if event.trial_id in self._newest_take:
                take = self._newest_take[event.trial_id]
                return _withdrawal(entry, event.trial_id, take, ALL_LABELS, event.why)
            case _:
                return None

    def _remember(self, entry: Entry) -> None:
        event = entry.event
        if isinstance(event, ev.LabelEvent):
            self._takes[entry.seq] = event.take
        if isinstance(event, ev.Executed):
            self._newest_take[event.trial_id] = event.take


def _label(entry: Entry, event: ev.LabelEvent) -> LabelRecord:
    return LabelRecord(
        trial_id=event.trial_id,
        take=event.take,
        time_ns=entry.time_ns,
        event_id=str(entry.seq),
        revision=entry.seq,
        outcome=event.outcome.value,
        reason=event.reason.value if event.reason else "",
        note=event.note,
        operator=event.operator,
        second=isinstance(event, ev.SecondLabelled),
        details={
            "rotated": str(event.rotated).lower(),
            "blind": str(event.blind).lower(),
            "source": event.source.value,
        },
    )


def _score(entry: Entry, event: ev.Scored) -> ScoreRecord:
    numbers = {
        name: float(value)
        for name, value in event.details.items()
        if isinstance(value, int | float) and not isinstance(value, bool)
    }
    return ScoreRecord(
        trial_id=event.trial_id,
        take=event.take,
        time_ns=entry.time_ns,
        event_id=str(entry.seq),
        revision=entry.seq,
        model=event.model,
        version=event.version,
        value=event.value,
        details=numbers,
        texts={n: json.dumps(v) for n, v in event.details.items() if n not in numbers},
    )


def _withdrawal(
    entry: Entry, trial_id: str, take: int, what: int | str, why: str = ""
) -> LabelRecord:
    return LabelRecord(
        trial_id=trial_id,
        take=take,
        time_ns=entry.time_ns,
        event_id=str(entry.seq),
        revision=entry.seq,
        note=why,
        withdraws=str(what),
    )
