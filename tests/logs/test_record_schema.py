"""One schema source: the generated modules are what the source says."""

from pathlib import Path

import pytest

from logs.schema.generate import SCHEMA_FOLDER, SOURCES, generate

pytest.importorskip("grpc_tools", reason="needs the dev extra")


def test_generated_files_match_their_source(tmp_path: Path) -> None:
    generated = generate(tmp_path)
    assert len(generated) == 2 * len(SOURCES)
    for path in generated:
        checked_in = (SCHEMA_FOLDER / path.name).read_text()
        assert path.read_text() == checked_in, "run `python -m logs.schema.generate`"


def test_field_numbers_of_the_released_format_stay() -> None:
    """A file of format 1 must mean the same for ever: numbers are never given to other fields."""
    from logs.schema import trial_v1_pb2 as v1

    numbers = {
        message: {field.name: field.number for field in descriptor.fields}
        for message, descriptor in v1.DESCRIPTOR.message_types_by_name.items()
    }
    assert numbers["TrialStart"]["format_version"] == 2
    assert numbers["TrialStart"]["trial_id"] == 3
    assert numbers["Execution"]["T_world_gripper"] == 4
    assert numbers["Registration"]["covariance"] == 4
    assert numbers["TrialStop"]["exit_status"] == 2
    assert numbers["Score"]["value"] == 8
    assert numbers["Label"]["outcome"] == 5
