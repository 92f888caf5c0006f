"""The Markdown page says what the JSON says, beside the paper's figures, and what was found."""

import io
import json
import re

import pytest
from rich.console import Console

from collection.analysis.evaluating import evaluation_content
from collection.cli.evaluation_table import evaluation_table
from logs.numbers import span
from logs.report.table_page import table_page
from reach.evaluation.compare import compare, scorers_of
from reach.evaluation.protocol import run_protocol
from reach.models.registry import make_scorer
from reach.pose_error import PoseError

ERROR = PoseError.isotropic(translation=1e-3, rotation=3e-3)
BASIS = {"translation": 1e-3, "rotation": 3e-3, "basis": "made up"}
NAMES = ("point", "reach", "settled")


@pytest.fixture(scope="module")
def content(make_dataset, tmp_path_factory):
    cache = tmp_path_factory.mktemp("cache")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("reach.evaluation.score_cache.cache_folder", lambda: cache)
        dataset = make_dataset(objects=5, grasps=4, repeats=3)
        result = compare(dataset.cases(), scorers_of(NAMES), pose_error=ERROR)
        protocol = run_protocol(result, make_scorer, NAMES, pose_error=ERROR, draws=4)
        found = evaluation_content(dataset, result, BASIS, protocol)
    return json.loads(json.dumps(found))


def tables(page):
    """Tables of the page: a list of lists of cells, by the text above them."""
    found, block = [], []
    for line in [*page.splitlines(), ""]:
        if line.startswith("|"):
            block.append([cell.strip() for cell in line.strip("|").split("|")])
        elif block:
            found.append(block)
            block = []
    return found


def test_every_table_is_well_formed_and_holds_the_numbers(content):
    page = table_page(content, "reach evaluate S")
    main, gains, held_out, held_gains, majority, objects, parameters = tables(page)
    for table in (main, gains, held_out, held_gains, majority, objects, parameters):
        assert len({len(row) for row in table}) == 1, table
        assert set(table[1]) == {"---"}
    lines = {row[0]: row for row in main[2:]}
    assert list(lines) == ["point", "reach", "settled [1]", "*constant*", "*overlap*", "*oracle*"]
    for name in ("point", "reach"):
        row = content["models"][name]
        low, high = row["intervals"]["ap"]
        assert lines[name][1] == f"{row['ap']:.3f} ({span([low, high])})"
        assert lines[name][3:6] == [f"{row[key]:.3f}" for key in ("f1", "mae", "brier")]
    assert lines["reach"][-3:] == ["0.77", "0.72", "0.053"]
    assert lines["*oracle*"][-3:] == ["", "", ""]
    assert [row[0] for row in objects[2:]] == [f"part {i}" for i in range(5)]
    assert [row[0] for row in parameters[2:]] == ["point", "reach", "settled [1]"]
    # The paper's figures stand beside the treatment of the depth that the paper used.
    by_depth = {(row[0], row[1]): row for row in held_out[2:]}
    assert set(by_depth) == {
        ("point", "none"),
        ("reach", "saturated"),
        ("reach", "unsaturated"),
    }
    assert by_depth["reach", "unsaturated"][7:9] == ["0.77", "0.72"]
    assert by_depth["reach", "saturated"][7:9] == ["", ""]
    assert "Parameters not drawn: settled." in page


def test_simulated_labels_are_marked_and_models_of_the_same_engine_named(content):
    page = table_page(content, "reach evaluate S")
    assert "**Simulated.**" in page and "[1] its grade was fitted on trials of this engine" in page
    assert "share assumptions" in page
    with_dynamic = json.loads(json.dumps(content))
    with_dynamic["models"] = {"dynamic": content["models"]["reach"], **content["models"]}
    assert "[1] same engine as the labels: a ceiling, not a rival." in table_page(with_dynamic, "x")
    physical = {**with_dynamic, "simulated": False}
    text = table_page(physical, "x")
    assert "share assumptions" not in text
    assert "Simulated" not in text and "ceiling" not in text and "[1]" not in text


def test_the_finding_is_stated_as_it_is(content):
    (gain,) = content["gains"]
    assert gain["ar"] == pytest.approx(
        content["models"]["reach"]["ar"] - content["models"]["point"]["ar"]
    )
    for ar, ap, verdict in ((0.2, 0.0, "yes"), (0.1, 0.1, "**no**"), (0.2, -0.01, "**no**")):
        changed = {**content, "gains": [{**gain, "ar": ar, "ap": ap, "as_published": None}]}
        changed["gains"][0]["as_published"] = ar >= 0.11 and ap >= 0
        changed["gains"][0]["certain"] = True
        assert tables(table_page(changed, "x"))[1][2][-1] == verdict
    changed["gains"][0] |= {"as_published": True, "certain": False}
    assert tables(table_page(changed, "x"))[1][2][-1] == "yes, but less is not excluded"
    assert "were not both evaluated" in table_page({**content, "gains": []}, "x")


def test_the_page_names_the_data_and_the_command(content):
    page = table_page(content, "reach evaluate S --models all")
    assert "```sh\nreach evaluate S --models all\n```" in page
    assert "Left out: 1 executed, not labeled." in page
    assert "60 trials of 20 planned grasps on 5 objects" in page
    without = {key: value for key, value in content.items() if key != "cross_validation"}
    assert "Leave one object out" not in table_page(without, "x")


def test_the_oracle_is_called_a_ceiling_only_of_what_it_bounds(content):
    models = content["models"]
    assert models["constant"]["ar"] == 1.0 > models["oracle"]["ar"]
    for key in ("mae", "brier"):
        assert all(row[key] >= models["oracle"][key] for row in models.values())
    assert "bounds neither AR nor F1" in table_page(content, "x")


def test_the_printed_tables_fit_into_eighty_columns(content):
    """Nothing is cut off, and every row of the JSON stands there."""
    screen = Console(width=80, record=True, file=io.StringIO())
    for table in evaluation_table(content):
        screen.print(table)
    text = screen.export_text()
    assert "…" not in text
    for name, row in content["models"].items():
        assert re.search(rf"^ *{name} +{row['ap']:.3f} ", text, re.MULTILINE)
    assert "unsaturated" in text


def test_intervals_are_rounded_outward_and_explained(content):
    assert span([0.996, 0.9999]) == "0.99 to 1.00"
    assert span([0.84, 1.0]) == "0.84 to 1.00"
    assert span([-0.0001, 0.2], with_sign=True) == "-0.01 to +0.20"
    assert span([0.0, 0.123], with_sign=True) == "+0.00 to +0.13"
    assert span(None) == ""
    assert "Intervals: 95 %, bootstrap over objects" in table_page(content, "x")
    constant = next(row for row in tables(table_page(content, "x"))[0] if row[0] == "*constant*")
    assert constant[2] == "1.000"  # by definition: no interval
    few = json.loads(json.dumps(content))
    few["interval_note"] = "No intervals: too few objects."
    for row in few["models"].values():
        row["intervals"] = dict.fromkeys(row["intervals"])
    for gain in few["gains"]:
        gain["ar_interval"] = gain["ap_interval"] = None
    page = table_page(few, "x")
    assert "too few objects" in page and "in parentheses" not in page
    assert tables(page)[0][2][1] == f"{content['models']['point']['ap']:.3f}"
