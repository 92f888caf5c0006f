"""Other people's readers open every file: the stock MCAP reader, and Rerun's importer."""

from pathlib import Path

import pytest
from mcap.reader import make_reader
from mcap_protobuf.decoder import DecoderFactory

from logs import topics
from logs.recorder import TrialRecorder
from logs.salvage import salvage


@pytest.fixture(scope="module")
def files(made, tmp_path_factory, fixtures: Path) -> list[Path]:
    folder = tmp_path_factory.mktemp("files")
    with TrialRecorder(folder / "whole") as recorder:
        whole = made.record_trial(recorder, samples=8)
    torn = folder / "torn"
    torn.mkdir()
    (torn / "trial.mcap.part").write_bytes(whole.read_bytes()[:-15_000])
    saved = salvage(torn)
    assert saved is not None and saved.record is not None
    return [whole, saved.record, *sorted((fixtures / "record_v1").glob("*.mcap"))]


def test_the_stock_reader_decodes_every_message(files: list[Path]) -> None:
    for path in files:
        with path.open("rb") as stream:
            reader = make_reader(stream, validate_crcs=True, decoder_factories=[DecoderFactory()])
            summary = reader.get_summary()
            assert summary is not None and summary.statistics is not None
            decoded = list(reader.iter_decoded_messages())
            assert len(decoded) == summary.statistics.message_count > 0
            for schema, channel, message, proto in decoded:
                expected = topics.message_type(channel.topic)
                assert expected is not None and schema.name == expected.DESCRIPTOR.full_name
                assert channel.message_encoding == "protobuf"
                assert proto.DESCRIPTOR.full_name == schema.name
                assert message.sequence < len(decoded)


def test_metadata_and_attachments_for_other_tools(made, files: list[Path]) -> None:
    with files[0].open("rb") as stream:
        reader = make_reader(stream)
        (metadata,) = reader.iter_metadata()
        assert metadata.name == "reach-trials"
        assert metadata.metadata["trial_id"] == made.TRIAL_ID
        assert metadata.metadata["seed"] == "7" and "version.numpy" in metadata.metadata
        names = {attachment.name: attachment.media_type for attachment in reader.iter_attachments()}
    assert names["object.ply"] == "model/ply" and names["robot.json"] == "application/json"


def test_rerun_imports_every_file(files: list[Path]) -> None:
    chunks = pytest.importorskip("rerun.chunk")
    for path in files:
        entities = {str(chunk.entity_path) for chunk in chunks.McapReader(str(path)).stream()}
        if path.name == "trial.mcap":
            assert {"/camera/depth/depth", "/camera/color/color", "/tf", "/gripper/jaw"} <= entities
        else:
            assert "/annotation/log" in entities
