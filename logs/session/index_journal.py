"""What of the journal an index has seen, what is new, and the events that tell of a few trials.

A journal only grows. If the bytes that the index has seen are still the same, only what follows
is new; and where a trial stands follows from the lines about it and those about the session.
"""

from __future__ import annotations

import re
import zlib
from collections.abc import Collection
from dataclasses import dataclass
from pathlib import Path

from logs.journal.events import Entry
from logs.journal.file import scan_lines

_TRIAL_ID = re.compile(rb'"trial_id":"([^"]*)"')
"""The first in a line is the event's own: a quote within a text has a backslash before it."""


@dataclass(frozen=True, slots=True)
class JournalMark:
    """How far a journal was read.

    Args:
        size: of what was read, which ends with a line [bytes].
        crc: CRC-32 of it.
        seq: number of the last event in it.
    """

    size: int
    crc: int
    seq: int


@dataclass(frozen=True, slots=True)
class JournalNews:
    """What follows a mark.

    Args:
        trials: ids of the trials that it tells of.
        of_session: it also tells of the session as a whole.
    """

    trials: frozenset[str]
    of_session: bool


def complete_lines(path: Path) -> bytes:
    """A journal's content without an unfinished last line (a writer at work)."""
    content = path.read_bytes()
    return content[: content.rfind(b"\n") + 1]


def mark_end(content: bytes) -> JournalMark:
    """The mark of a journal that was read to its end.

    Args:
        content: as `complete_lines` returns it; every line is good.
    """
    last = scan_lines(content[content[:-1].rfind(b"\n") + 1 :]).entries
    return JournalMark(len(content), zlib.crc32(content), last[-1].seq if last else 0)


def news_since(content: bytes, mark: JournalMark) -> tuple[JournalNews, JournalMark] | None:
    """What is new, and the mark after it; None if the journal must be read as a whole.

    Args:
        content: as `complete_lines` returns it.
        mark: of what was read before.
    """
    seen = memoryview(content)[: mark.size]
    if len(seen) < mark.size or zlib.crc32(seen) != mark.crc:
        return None
    scan = scan_lines(content[mark.size :])
    entries = scan.entries
    expected = range(mark.seq + 1, mark.seq + 1 + len(scan.lines))
    if [entry.seq for entry in entries] != list(expected):
        return None  # damaged or repaired
    ids = [getattr(entry.event, "trial_id", None) for entry in entries]
    trials = frozenset(one for one in ids if one is not None)
    seq = entries[-1].seq if entries else mark.seq
    return JournalNews(trials, None in ids), JournalMark(len(content), zlib.crc32(content), seq)


def entries_about(content: bytes, trials: Collection[str]) -> tuple[Entry, ...]:
    """The entries about some trials, and those about the session, in their order.

    Args:
        content: as `complete_lines` returns it; every line is good.
        trials: ids.
    """
    wanted = {trial.encode() for trial in trials}
    lines = (line for line in content.splitlines(keepends=True) if _is_about(line, wanted))
    return scan_lines(b"".join(lines)).entries


def _is_about(line: bytes, trials: Collection[bytes]) -> bool:
    found = _TRIAL_ID.search(line)
    return found is None or found[1] in trials
