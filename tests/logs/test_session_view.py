"""The session's view: all trials in one recording, disagreements first."""

import io
from pathlib import Path

import numpy as np
import pytest

from logs.errors import UnknownTrialError, ViewError
from logs.session.find_trial import find_take
from logs.session.folder import SessionFolder
from logs.session.index import list_takes
from logs.session.index_table import IndexRow
from logs.trial_folder import RECORD_NAME
from logs.view.session import write_session_view
from logs.view.session_overview import TIMELINES, judging_model, overview
from logs.view.session_text import contents, headline


def read_view(path: Path) -> tuple[set[str], str]:
    """Entities of a view, and all its text."""
    from rerun.chunk import RrdReader

    entities, words = set(), []
    for chunk in RrdReader(str(path)).stream():
        entities.add(str(chunk.entity_path))
        batch = chunk.to_record_batch()
        words += [str(batch.column(i).to_pylist()) for i in range(batch.num_columns)
                  if "Text" in batch.schema.field(i).name]  # fmt: skip
    return entities, "\n".join(words)


@pytest.fixture(scope="module")
def session(sessions, tmp_path_factory) -> SessionFolder:
    return sessions.build_session(tmp_path_factory.mktemp("s") / "session", 5, samples=3)


def test_disagreements_come_first(session: SessionFolder) -> None:
    shown = overview(list_takes(session.path), "reach")
    gaps = [item.disagreement for item in shown]
    assert gaps == sorted(gaps, reverse=True)
    assert "reach" in shown[0].wrong and "reach" not in shown[-1].wrong
    assert [item.places["disagreement"] for item in shown] == [1, 2, 3, 4, 5]
    for timeline in TIMELINES:
        assert sorted(item.places[timeline] for item in shown) == [1, 2, 3, 4, 5]
    by_outcome = sorted(shown, key=lambda item: item.places["by_outcome"])
    assert [item.row.outcome for item in by_outcome] == ["failure"] + ["success"] * 4


def test_all_trials_are_in_one_recording(session: SessionFolder, tmp_path: Path) -> None:
    from rerun.chunk import RrdReader

    path = write_session_view(session.path, tmp_path / "all.rrd", "reach")
    entities, text = read_view(path)
    assert {
        "/scene/objects/cube_3cm",
        "/scene/objects/bracket",
        "/scene/hand",
        "/picture",
    } <= entities
    for number in range(1, 6):
        assert f"{number:04d} " in text and f"Trial {number}:" in text
    for item in overview(list_takes(session.path), "reach"):
        assert headline(item, "reach") in text
    assert "reach* disagrees with " in text and "| bracket | 3 |" in text
    steps: dict[str, set[int]] = {name: set() for name in TIMELINES}
    for chunk in RrdReader(str(path)).stream():  # a slow machine writes them in several chunks
        if str(chunk.entity_path) == "/summary":
            batch = chunk.to_record_batch()
            for name in TIMELINES:
                steps[name] |= set(batch.column(name).to_pylist())
    assert list(steps.values()) == [{1, 2, 3, 4, 5}] * 4


def row(number: int, scores: dict[str, float], outcome: str | None = "success") -> IndexRow:
    reason = "missed" if outcome == "failure" else None
    return IndexRow(
        f"id-{number}", 1, number, f"trials/{number:04d}_id-{number}", "cube", "g", "executed",
        True, outcome, reason, "held", "complete", None, scores,
    )  # fmt: skip


def test_the_judge_is_the_report_s_unless_another_is_asked_for() -> None:
    rows = [row(1, {"point": 1.0, "reach": 0.0, "settled-robust": 0.4})]
    assert judging_model(rows) == "settled-robust"
    assert judging_model(rows, "point") == "point"
    assert judging_model([row(1, {"mine": 0.5})]) == "mine" and judging_model([row(1, {})]) is None
    with pytest.raises(ViewError, match="'ellipse'; valid: point, reach, settled-robust"):
        judging_model(rows, "ellipse")


def test_among_equal_disagreements_what_misled_most_models_comes_first() -> None:
    rows = [
        row(1, {"a": 0.0, "b": 1.0}),
        row(2, {"a": 0.0, "b": 0.0}),
        row(3, {"a": 0.2, "b": 0.0}),
        row(4, {"a": 0.0}, outcome=None),
        row(5, {"a": 1.0, "b": 1.0}),
    ]
    shown = overview(rows, "a")
    assert [item.row.number for item in shown] == [2, 1, 3, 5, 4]
    assert shown[0].wrong == ("a", "b") and shown[1].wrong == ("a",) and shown[4].wrong == ()
    assert headline(shown[0], "a") == "0002 cube: success; a says 0.00; 2 of 2 models disagree"
    assert headline(shown[4], "a") == "0004 cube: not labeled; a says 0.00"


def test_contents_say_where_objects_and_outcomes_are() -> None:
    rows = [row(1, {"a": 0.9}), row(2, {"a": 0.9}, "failure"), row(3, {}, None)]
    text = contents("monday", overview(rows, "a"), "a")
    assert "### monday: 3 trials" in text and "*a* disagrees with 1 of 2 labels." in text
    assert "| cube | 3 | 1 | 1 | 1 to 3 |" in text
    assert "| failure, missed | 1 | 0 | 1 | 1 |" in text
    assert "| not labeled | 1 | 0 | 0 | 3 |" in text


def shown_object_at(path: Path, step: int) -> set[str]:
    """Objects that have a size at a step of the order of trials."""
    from rerun.chunk import RrdReader

    found = set()
    for chunk in RrdReader(str(path)).stream():
        entity = str(chunk.entity_path)
        batch = chunk.to_record_batch()
        if entity.startswith("/scene/objects/") and "trial" in batch.schema.names:
            place = batch.column("trial").to_pylist().index(step)
            if np.any(batch.column("InstancePoses3D:mat3x3")[place].as_py()):
                found.add(entity.rpartition("/")[2])
    return found


def test_each_step_shows_its_own_object_alone(session: SessionFolder, tmp_path: Path) -> None:
    path = write_session_view(session.path, tmp_path / "all.rrd")
    for trial in session.descriptor.trials[:5]:
        assert shown_object_at(path, trial.number) == {trial.object_name}


def test_every_step_sets_whatever_any_step_sets(
    session: SessionFolder, tmp_path: Path, monkeypatch
) -> None:
    """Else, in another order, a step would show what an earlier one left behind."""
    from PIL import Image
    from rerun.chunk import RrdReader

    monkeypatch.setattr("logs.view.session.PICTURES", 2)
    steps: dict[str, set[int]] = {}
    sizes = set()
    for chunk in RrdReader(str(write_session_view(session.path, tmp_path / "all.rrd"))).stream():
        batch = chunk.to_record_batch()
        if "by_outcome" in batch.schema.names:
            found = steps.setdefault(str(chunk.entity_path), set())
            found |= set(batch.column("by_outcome").to_pylist())
        if "EncodedImage:blob" in batch.schema.names:
            blobs = batch.column("EncodedImage:blob").to_pylist()
            sizes |= {Image.open(io.BytesIO(bytes(blob[0]))).size for blob in blobs}
    assert sizes == {(400, 300)}  # the viewer reports a change of size as an error
    assert {"/picture", "/scene/contacts/pressure", "/scene/contacts/force"} <= set(steps)
    assert {entity for entity, found in steps.items() if found != {1, 2, 3, 4, 5}} == set()


def test_an_unreadable_record_is_a_step_that_says_so(sessions, tmp_path: Path) -> None:
    folder = sessions.build_session(tmp_path / "s", 3, samples=2)
    broken = folder.path / list_takes(folder.path)[1].folder / RECORD_NAME
    broken.write_bytes(b"nothing to read")
    _, text = read_view(write_session_view(folder.path, tmp_path / "all.rrd"))
    assert "no start message" in text and "Trial 1:" in text and "Trial 3:" in text


def test_a_session_without_trials_says_so(sessions, tmp_path: Path) -> None:
    folder = sessions.make_session(tmp_path / "s", 2)
    with pytest.raises(ViewError, match="no executed trial"):
        write_session_view(folder.path, tmp_path / "all.rrd")


def test_a_trial_is_found_by_number_id_and_beginning(session: SessionFolder) -> None:
    second = session.descriptor.trials[1].trial_id
    expected = session.trial_folder(second)
    assert find_take(session.path, "2") == expected
    assert find_take(session.path, second) == expected
    assert find_take(session.path, second[:13]) == expected


@pytest.mark.parametrize("wanted", ["99", "", "zzz", "0"])
def test_an_unknown_trial_is_one_clear_error(session: SessionFolder, wanted: str) -> None:
    with pytest.raises(UnknownTrialError, match=r"valid: a number from 1 to 6") as raised:
        find_take(session.path, wanted)
    assert "\n" not in str(raised.value)


def test_a_trial_without_record_is_one_clear_error(session: SessionFolder) -> None:
    with pytest.raises(UnknownTrialError, match="trial 6 .* has no record yet"):
        find_take(session.path, "6")
