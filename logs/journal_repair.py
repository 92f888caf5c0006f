"""Mending a damaged journal: good lines stay, bad ones are set aside, the loss is named in it."""

from __future__ import annotations

import os
import shutil
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from logs.durable import sync_directory, write_durably
from logs.events import Entry, JournalRepaired
from logs.journal import JournalScan, encode_entry, scan_journal


@dataclass(frozen=True, slots=True)
class JournalRepair:
    """What was mended.

    Args:
        original: copy of the journal as it was found.
        lost: sequence numbers of the events that are gone.
        problems: what was wrong, line by line.
    """

    original: Path
    lost: tuple[int, ...]
    problems: tuple[str, ...]


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
    original = _keep_copy(path)
    problems = tuple(f"line {line.number} {line.problem}" for line in scan.bad)
    text = "; ".join(problems) or f"events {sorted(lost)} are missing"
    last = max([*(entry.seq for entry in scan.entries), *lost], default=0)
    repaired = Entry(
        seq=last + 1,
        time_ns=clock(),
        event=JournalRepaired(lost=tuple(sorted(lost)), text=text[:2000]),
    )
    good = b"".join(line.raw + b"\n" for line in scan.lines if line.entry is not None)
    _replace(path, good + encode_entry(repaired) + scan.torn)
    return JournalRepair(original, tuple(sorted(lost)), problems)


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


def _keep_copy(path: Path) -> Path:
    number = 1
    while (copy := path.with_name(f"{path.name}.damaged{number}")).exists():
        number += 1
    shutil.copy2(path, copy)
    with copy.open("rb") as stream:
        os.fsync(stream.fileno())
    return copy


def _replace(path: Path, content: bytes) -> None:
    temporary = path.with_name(f".{path.name}.repair")
    write_durably(temporary, content)
    os.replace(temporary, path)
    sync_directory(path.parent)
