"""Mending a damaged journal: good lines stay, bad ones are set aside, the loss is named in it."""

from __future__ import annotations

import os
import re
import time
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path

from logs.durable import sync_directory, write_durably
from logs.journal.events import AnyEvent, Entry, JournalRepaired, NeedsLabel
from logs.journal.file import JournalLine, JournalScan, encode_entry, scan_journal

BAD_NAME = "events.bad"
_TRIAL_ID = re.compile(rb'"trial_id":"([^"]+)"')
_NO_DECISION = re.compile(
    rb'"kind":"(score|phase|placed|pose_accepted|object_replaced|trial_started)"'
)
"""Kinds that decide nothing: a damaged byte does not turn a decision into one of them."""


@dataclass(frozen=True, slots=True)
class JournalRepair:
    """What was mended.

    Args:
        aside: file that holds the damaged lines.
        lost: sequence numbers of the events that are gone.
        problems: what was wrong, line by line.
        touched: trials that a lost decision may have been about; the journal now says that
            they need a label.
    """

    aside: Path
    lost: tuple[int, ...]
    problems: tuple[str, ...]
    touched: tuple[str, ...]


def repair_journal(path: Path, clock: Callable[[], int] = time.time_ns) -> JournalRepair | None:
    """Set a journal's damaged lines aside; None if there is nothing to mend.

    An unfinished last line is none of them: opening the journal sets it aside. The caller holds
    the session's lock.

    Args:
        path: the journal.
        clock: nanoseconds since the epoch.
    """
    scan = scan_journal(path)
    lost = _lost(scan)
    if not scan.bad and not lost:
        return None
    aside = path.with_name(BAD_NAME)
    _set_aside(aside, scan.bad)
    problems = tuple(f"line {line.number} {line.problem}" for line in scan.bad)
    touched = _touched(scan)
    text = "; ".join(problems) or f"events {sorted(lost)} are missing"
    last = max([*(entry.seq for entry in scan.entries), *lost], default=0)
    why = f"the journal lost a line that may have decided about this trial ({text})"
    events: list[AnyEvent] = [
        JournalRepaired(lost=tuple(sorted(lost)), text=text),
        *(NeedsLabel(trial_id=trial_id, why=why) for trial_id in touched),
    ]
    added = [
        Entry(seq=seq, time_ns=clock(), event=event)
        for seq, event in enumerate(events, start=last + 1)
    ]
    good = b"".join(line.raw + b"\n" for line in scan.lines if line.entry is not None)
    _replace(path, good + b"".join(map(encode_entry, added)) + scan.torn)
    return JournalRepair(aside, tuple(sorted(lost)), problems, touched)


def _touched(scan: JournalScan) -> tuple[str, ...]:
    """Trials that lost lines may have decided about: an undo may be among them, or a redo."""
    found: dict[str, None] = {}
    for place, line in enumerate(scan.lines):
        if line.entry is None and not _NO_DECISION.search(line.raw):
            named = [name.decode(errors="replace") for name in _TRIAL_ID.findall(line.raw)]
            found |= dict.fromkeys(named or _neighbors(scan, place))
    known = set(_trials(scan.lines))
    return tuple(trial_id for trial_id in found if trial_id in known)


def _neighbors(scan: JournalScan, place: int) -> list[str]:
    """Trials of the lines around one whose own trial cannot be read."""
    before = list(_trials(scan.lines[:place]))[-1:]
    return before + list(_trials(scan.lines[place + 1 :]))[:1]


def _trials(lines: Iterable[JournalLine]) -> Iterable[str]:
    events = (line.entry.event for line in lines if line.entry is not None)
    return (t for t in (getattr(event, "trial_id", None) for event in events) if t is not None)


def _lost(scan: JournalScan) -> set[int]:
    """Numbers that no good line has: holes between them, and bad lines at the end."""
    present = {entry.seq for entry in scan.entries}
    known = {
        seq
        for entry in scan.entries
        if isinstance(entry.event, JournalRepaired)
        for seq in entry.event.lost
    }
    last = max(present, default=0)
    trailing = 0
    for line in reversed(scan.lines):
        if line.entry is not None:
            break
        trailing += 1
    return set(range(1, last + trailing + 1)) - present - known


def _set_aside(aside: Path, lines: Iterable[JournalLine]) -> None:
    earlier = aside.read_bytes() if aside.exists() else b""
    write_durably(aside, earlier + b"".join(line.raw + b"\n" for line in lines))


def _replace(path: Path, content: bytes) -> None:
    temporary = path.with_name(f".{path.name}.repair")
    write_durably(temporary, content)
    os.replace(temporary, path)
    sync_directory(path.parent)
