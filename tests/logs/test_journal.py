"""The journal under torn tails, bad middles, failing disks and second writers."""

from __future__ import annotations

import errno
import itertools
import os
from pathlib import Path

import pytest

from logs.errors import JournalDamagedError, JournalWriteError, SessionLockedError
from logs.journal.events import JournalRepaired, Noted, SessionClosed, Source
from logs.journal.file import (
    JOURNAL_NAME,
    TORN_NAME,
    Journal,
    encode_entry,
    read_journal,
    scan_journal,
)


def note(text: str) -> Noted:
    return Noted(text=text, operator="ann", source=Source.OPERATOR)


def texts(path: Path) -> list[str]:
    return [entry.event.text for entry in read_journal(path)]  # type: ignore[union-attr]


@pytest.fixture
def path(tmp_path: Path) -> Path:
    file = tmp_path / JOURNAL_NAME
    file.touch()
    return file


@pytest.fixture
def three(path: Path) -> Path:
    with Journal(path, clock=itertools.count(100).__next__) as journal:
        for text in ("one", "two", "three"):
            journal.append(note(text))
    return path


def test_appended_events_read_back_in_order_with_number_and_time(three: Path) -> None:
    entries = read_journal(three)
    assert [(entry.seq, entry.time_ns) for entry in entries] == [(1, 100), (2, 101), (3, 102)]
    assert texts(three) == ["one", "two", "three"]


def test_an_event_is_synced_before_it_is_acknowledged(path: Path) -> None:
    synced: list[int] = []
    with Journal(path, fsync=lambda descriptor: synced.append(os.fstat(descriptor).st_size)) as j:
        j.append(note("one"))
        assert synced == [path.stat().st_size]


def test_every_cut_of_the_last_line_keeps_the_others_and_sets_the_tail_aside(three: Path) -> None:
    whole = three.read_bytes()
    start = whole.rindex(b"\n", 0, -1) + 1
    for cut in range(start, len(whole)):
        three.write_bytes(whole[:cut])
        (three.parent / TORN_NAME).unlink(missing_ok=True)
        with Journal(three) as journal:
            assert [entry.seq for entry in journal.entries] == [1, 2]
            assert journal.append(note("after")).seq == 3
        assert texts(three) == ["one", "two", "after"]
        if cut > start:
            assert (three.parent / TORN_NAME).read_bytes() == whole[start:cut] + b"\n"


def test_a_tail_of_zero_bytes_after_a_power_cut_is_torn(three: Path) -> None:
    with three.open("ab") as stream:
        stream.write(b"\0" * 4096)
    with Journal(three) as journal:
        assert len(journal.entries) == 3
    assert texts(three) == ["one", "two", "three"]


@pytest.mark.parametrize("line", [1, 2, 3])
def test_any_flipped_bit_in_a_complete_line_is_refused_with_its_number(
    three: Path, line: int
) -> None:
    lines = three.read_bytes().split(b"\n")
    good = lines[line - 1]
    for position in range(0, len(good), 7):
        damaged = good[:position] + bytes([good[position] ^ 4]) + good[position + 1 :]
        lines[line - 1] = damaged
        three.write_bytes(b"\n".join(lines))
        with pytest.raises(JournalDamagedError, match=rf"line {line} .*reach recover") as caught:
            read_journal(three)
        assert caught.value.line == line
        with pytest.raises(JournalDamagedError):
            Journal(three)


def test_a_refused_journal_is_left_untouched_and_unlocked(three: Path) -> None:
    lines = three.read_bytes().split(b"\n")
    lines[0] = b"{}"
    three.write_bytes(b"\n".join(lines))
    before = three.read_bytes()
    for _ in range(2):
        with pytest.raises(JournalDamagedError):
            Journal(three)
    assert three.read_bytes() == before


def test_a_missing_line_is_a_gap_until_a_repair_names_it(three: Path) -> None:
    lines = three.read_bytes().splitlines(keepends=True)
    three.write_bytes(lines[0] + lines[2])
    with pytest.raises(JournalDamagedError, match=r"line 2 follows a gap: events \[2\]"):
        read_journal(three)
    entry = read_scan_last(three).model_copy(update={"seq": 4, "event": JournalRepaired(lost=(2,))})
    with three.open("ab") as stream:
        stream.write(encode_entry(entry))
    assert [entry.seq for entry in read_journal(three)] == [1, 3, 4]


def read_scan_last(path: Path):  # type: ignore[no-untyped-def]
    return scan_journal(path).entries[-1]


def test_a_repeated_line_is_refused(three: Path) -> None:
    last = three.read_bytes().splitlines(keepends=True)[-1]
    with three.open("ab") as stream:
        stream.write(last)
    with pytest.raises(JournalDamagedError, match="line 4 repeats number 3"):
        read_journal(three)


def test_scan_keeps_good_lines_beside_bad_ones(three: Path) -> None:
    lines = three.read_bytes().splitlines(keepends=True)
    three.write_bytes(lines[0] + b"noise\n" + lines[2])
    scan = scan_journal(three)
    assert [entry.seq for entry in scan.entries] == [1, 3]
    assert [(line.number, line.raw) for line in scan.bad] == [(2, b"noise")]


def test_there_is_one_writer_and_readers_are_welcome(three: Path) -> None:
    with Journal(three):
        with pytest.raises(SessionLockedError, match=f"process {os.getpid()}"):
            Journal(three)
        assert texts(three) == ["one", "two", "three"]
    Journal(three).close()


def test_a_failed_sync_is_not_acknowledged_and_leaves_nothing(path: Path) -> None:
    def fail(descriptor: int) -> None:
        raise OSError(errno.EIO, "input/output error")

    with Journal(path, fsync=fail) as journal:
        with pytest.raises(JournalWriteError, match="not stored"):
            journal.append(note("lost"))
        with pytest.raises(JournalWriteError, match="earlier event"):
            journal.append(note("later"))
    assert read_journal(path) == ()


def test_a_short_write_leaves_nothing_and_the_next_event_fits(
    path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    write = os.write
    with Journal(path) as journal:
        monkeypatch.setattr(os, "write", lambda fd, data: write(fd, data[:20]))
        with pytest.raises(JournalWriteError, match="only 20 of"):
            journal.append(note("too long"))
        monkeypatch.setattr(os, "write", write)
        journal.append(note("fits"))
    assert texts(path) == ["fits"]


def test_a_fault_told_at_length_is_stored_in_short(path: Path) -> None:
    with Journal(path) as journal:
        journal.append(SessionClosed(status="failed", reason="why " * 1000))
    closed = read_journal(path)[-1].event
    assert isinstance(closed, SessionClosed)
    assert closed.reason == ("why " * 1000)[:1996] + " ..."


def test_a_closed_journal_takes_no_events(path: Path) -> None:
    journal = Journal(path)
    journal.close()
    journal.close()
    with pytest.raises(JournalWriteError, match="closed"):
        journal.append(note("late"))
