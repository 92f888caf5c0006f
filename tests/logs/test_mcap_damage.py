"""Cut or altered files yield a correct prefix: never an exception, never an invented value."""

import random
from pathlib import Path

import pytest

from logs.errors import RecordReadError
from logs.record.annotation_files import read_annotations
from logs.record.mcap_walk import Walk, walk
from logs.record.recorder import TrialRecorder
from logs.record.trial_record import read_record

CUTS = FLIPS = 2000


@pytest.fixture(scope="module")
def whole(made, tmp_path_factory) -> tuple[bytes, Walk]:
    """A small record, as bytes and as read undamaged."""
    folder = tmp_path_factory.mktemp("small")
    with TrialRecorder(folder) as recorder:
        path = made.record_trial(recorder, samples=3, size=(16, 12))
    read = walk(path)
    assert read.finished and read.damage is None and len(read.messages) > 30
    return path.read_bytes(), read


def check_prefix(path: Path, data: bytes, whole: Walk) -> Walk:
    path.write_bytes(data)
    found = walk(path)
    assert found.messages == whole.messages[: len(found.messages)]
    assert found.attachments.items() <= whole.attachments.items()
    if found.damage is None:
        assert found.finished and len(found.messages) == len(whole.messages)
    return found


def check_decoding(path: Path, found: Walk, whole_count: int) -> None:
    try:
        record = read_record(path)
    except RecordReadError:
        assert len(found.messages) < 2  # only a missing beginning makes a record unreadable
        return
    assert record.message_count == len(found.messages) <= whole_count
    assert record.damage == found.damage


def test_every_cut_leaves_a_correct_prefix(whole, tmp_path: Path) -> None:
    data, undamaged = whole
    random_cuts = random.Random(1)
    path = tmp_path / "cut.mcap"
    counts = []
    places = sorted(random_cuts.sample(range(len(data)), CUTS))
    for n, place in enumerate(places):
        found = check_prefix(path, data[:place], undamaged)
        assert found.damage is not None and not found.finished
        counts.append(len(found.messages))
        if n % 10 == 0:
            check_decoding(path, found, len(undamaged.messages))
    assert counts == sorted(counts)  # more bytes never tell less
    assert counts[0] == 0 and counts[-1] == len(undamaged.messages)
    assert len(set(counts)) >= 4  # every flushed phase is its own step


def test_flipped_bytes_never_invent_anything(whole, tmp_path: Path) -> None:
    data, undamaged = whole
    randomly = random.Random(2)
    path = tmp_path / "flipped.mcap"
    unnoticed = 0
    for n in range(FLIPS):
        altered = bytearray(data)
        for _ in range(randomly.choice((1, 1, 1, 2, 8))):
            altered[randomly.randrange(len(altered))] ^= 1 << randomly.randrange(8)
        found = check_prefix(path, bytes(altered), undamaged)
        unnoticed += found.damage is None
        if n % 10 == 0:
            check_decoding(path, found, len(undamaged.messages))
    assert unnoticed < 0.02 * FLIPS  # only the file's name for its writer is without a checksum


def test_bytes_overwritten_in_blocks(whole, tmp_path: Path) -> None:
    data, undamaged = whole
    randomly = random.Random(3)
    for _ in range(200):
        altered = bytearray(data)
        size = randomly.choice((16, 512, 4096))
        place = randomly.randrange(len(altered))
        altered[place : place + size] = bytes(min(size, len(altered) - place))
        check_prefix(tmp_path / "zeros.mcap", bytes(altered), undamaged)


def test_what_stands_after_the_end_is_noticed(whole, tmp_path: Path) -> None:
    data, undamaged = whole
    found = check_prefix(tmp_path / "longer.mcap", data + b"more", undamaged)
    assert found.damage is not None and len(found.messages) == len(undamaged.messages)


def test_a_removed_chunk_is_a_hole_not_a_shortcut(whole, tmp_path: Path) -> None:
    """Records after a hole are whole in themselves; only their numbers tell that some are gone."""
    from mcap.opcode import Opcode

    data, undamaged = whole
    starts, place = [], 8
    while data[place] != Opcode.DATA_END:
        length = int.from_bytes(data[place + 1 : place + 9], "little")
        if data[place] == Opcode.CHUNK:
            starts.append((place, place + 9 + length))
        place += 9 + length
    begin, end = starts[1]
    found = check_prefix(tmp_path / "hole.mcap", data[:begin] + data[end:], undamaged)
    assert found.damage is not None and "missing" in found.damage
    assert 0 < len(found.messages) < len(undamaged.messages)


def test_a_damaged_annotation_is_named_and_harms_no_other(fixtures: Path, tmp_path: Path) -> None:
    for name in ("annotation.001.mcap", "annotation.002.mcap"):
        (tmp_path / name).write_bytes((fixtures / "record_v1" / name).read_bytes())
    first = tmp_path / "annotation.001.mcap"
    first.write_bytes(first.read_bytes()[:900])
    found = read_annotations(tmp_path)
    assert [path for path, _ in found.damaged] == [first]
    assert found.label is None and list(found.newest_scores) == ["reach"]
