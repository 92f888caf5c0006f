"""Other people's readers open every file: the stock MCAP reader, and Rerun's importer."""

import re
import subprocess
import sys
from pathlib import Path

import pytest
from mcap.reader import make_reader
from mcap_protobuf.decoder import DecoderFactory

from logs.record import topics
from logs.record.recorder import TrialRecorder
from logs.record.salvage import salvage
from logs.view.viewer import viewer_program


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


def test_rerun_s_checker_finds_no_fault(files: list[Path]) -> None:
    for path in files:
        command = [viewer_program(), "mcap", "check", "--full", str(path)]
        done = subprocess.run(command, capture_output=True, text=True, check=False)
        assert done.returncode == 0, done.stdout + done.stderr
        rows = re.findall(r"^(\w+) +\d+ +\d+ +(/\S+)", done.stdout, re.MULTILINE)
        assert len(rows) >= 2 and {status for status, _ in rows} == {"ok"}, done.stdout


def test_rerun_s_checker_would_find_one(files: list[Path], tmp_path: Path) -> None:
    cut = tmp_path / "cut.mcap"
    cut.write_bytes(files[0].read_bytes()[:-15_000])
    command = [viewer_program(), "mcap", "check", "--full", str(cut)]
    assert subprocess.run(command, capture_output=True, check=False).returncode != 0


def test_the_script_of_the_manual_reads_a_take(fixtures: Path) -> None:
    manual = Path(__file__).parents[2] / "docs" / "records.md"
    (script,) = re.findall(r"```python\n(.*?)```", manual.read_text(), re.DOTALL)
    assert len([line for line in script.splitlines() if line]) <= 10
    done = subprocess.run(
        [sys.executable, "-c", script, str(fixtures / "record_v1")],
        capture_output=True, text=True, check=True,
    )  # fmt: skip
    for words in ("trial.mcap", "reach_trials.v1.Execution", 'sensor_verdict: "held"',
                  "annotation.001.mcap", 'outcome: "success"', 'model: "reach"'):  # fmt: skip
        assert words in done.stdout, words


def test_the_manual_names_every_channel(files: list[Path]) -> None:
    manual = (Path(__file__).parents[2] / "docs" / "records.md").read_text()
    for path in files:
        with path.open("rb") as stream:
            summary = make_reader(stream).get_summary()
        assert summary is not None
        for channel in summary.channels.values():
            pieces = channel.topic.split("/")
            name = f"/{pieces[3]}`" if pieces[1] == "camera" else f"`{channel.topic}`"
            assert name in manual or f"`/camera/NAME/{pieces[-1]}`" in manual, channel.topic
