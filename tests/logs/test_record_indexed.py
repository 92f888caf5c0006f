"""Reading a few channels through a record's index gives what reading it whole gives, or refuses."""

import io
import shutil
import zlib

import pytest

from logs.errors import RecordReadError
from logs.record import topics
from logs.record.indexed import indexed_messages
from logs.record.mcap_walk import walk
from logs.record.outline import read_attachment, read_outline
from logs.record.trial_record import read_record

WANTED = (topics.START, topics.DESCRIPTOR, topics.REGISTRATION, topics.EXECUTION, topics.STOP)


@pytest.fixture(scope="module")
def record(tmp_path_factory, sessions):
    session = sessions.build_session(tmp_path_factory.mktemp("indexed") / "S", count=1)
    (path,) = session.trials.glob("*/trial.mcap")
    return path


def test_the_index_leads_to_the_same_messages_as_a_walk(record):
    for wanted in (WANTED, ("/robot/joint_states",), ("/nothing",)):
        walked = [message for message in walk(record).messages if message.topic in wanted]
        with record.open("rb") as stream:
            assert indexed_messages(stream, wanted) == walked


def test_whatever_byte_is_damaged_nothing_wrong_is_read(record, tmp_path):
    """Each flipped byte is either noticed, or lies where these messages are not."""
    good = record.read_bytes()
    expected = indexed_messages(io.BytesIO(good), WANTED)
    noticed = 0
    for place in range(3, len(good), max(1, len(good) // 400)):
        bad = good[:place] + bytes([good[place] ^ 0x41]) + good[place + 1 :]
        try:
            found = indexed_messages(io.BytesIO(bad), WANTED)
        except Exception:
            noticed += 1
        else:
            assert found == expected
    assert noticed > 20


@pytest.mark.parametrize("kept", [0, 10, 45, 0.5, -1])
def test_a_record_cut_short_is_refused_and_read_whole_instead(record, tmp_path, kept):
    good = record.read_bytes()
    size = int(kept * len(good)) if isinstance(kept, float) else kept % len(good)
    with pytest.raises(Exception) as refused:
        indexed_messages(io.BytesIO(good[:size]), WANTED)
    assert not isinstance(refused.value, AssertionError)
    if isinstance(kept, float):
        cut = tmp_path / "trial.mcap"
        cut.write_bytes(good[:size])
        found, whole = read_outline(cut), read_record(cut, images=False)
        assert found.descriptor.trial_id == whole.descriptor.trial_id
        assert whole.damage and found.damage == whole.damage


def test_a_summary_that_was_altered_is_refused(record):
    """Also where the altered bytes would still parse: its checksum says so."""
    good = bytearray(record.read_bytes())
    at = good.rindex(topics.EXECUTION.encode())
    good[at : at + 4] = b"/abc"
    with pytest.raises(RecordReadError, match="summary is damaged"):
        indexed_messages(io.BytesIO(bytes(good)), WANTED)
    assert zlib.crc32(bytes(good)) != zlib.crc32(record.read_bytes())


def test_attachments_of_whole_and_of_cut_records(record, tmp_path):
    mesh = read_attachment(record, "object.ply")
    assert mesh.startswith(b"ply")
    with pytest.raises(RecordReadError, match=r"holds no nothing\.txt; it has: .*object\.ply"):
        read_attachment(record, "nothing.txt")
    shutil.copyfile(record, tmp_path / "trial.mcap")
    with (tmp_path / "trial.mcap").open("rb+") as stream:
        stream.truncate(record.stat().st_size - 20)
    assert read_attachment(tmp_path / "trial.mcap", "object.ply") == mesh
