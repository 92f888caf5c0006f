"""`reach import`, `export`, `evaluate`, `fit` and `report` as a user types them."""

import json

import pytest
import typer.testing

from collection.cli.main import main
from logs.dataset.files import write_dataset


@pytest.fixture(scope="module")
def folder(make_dataset, tmp_path_factory):
    path = tmp_path_factory.mktemp("commands") / "d"
    write_dataset(make_dataset(objects=2, grasps=5, repeats=2), path, ("parquet",))
    return path


@pytest.fixture(autouse=True)
def own_cache(tmp_path, monkeypatch):
    monkeypatch.setattr("reach.evaluation.score_cache.cache_folder", lambda: tmp_path / "cache")
    monkeypatch.setattr("logs.report.page.PROBES", 40)


def test_evaluate_writes_and_prints(folder, tmp_path, capsys):
    out, plots = tmp_path / "table.json", tmp_path / "plots"
    arguments = ["evaluate", str(folder), "--models", "reach,point-robust", "--plots", str(plots)]
    assert main([*arguments, "--json", str(out), "--cross-validate", "--draws", "3"]) == 0
    content = json.loads(out.read_text())
    names = ["reach", "point-robust", "constant", "overlap", "oracle"]
    assert list(content["models"]) == names
    assert content["simulated"] is True
    assert content["pose_error"]["basis"] == "made up"
    folds = content["cross_validation"]["models"]
    assert [row["saturated"] for row in folds["reach"]] == [True, False]
    assert [row["saturated"] for row in folds["point-robust"]] == [None]
    assert {path.name for path in plots.iterdir()} == {"precision_recall.svg", "reliability.svg"}
    assert all("simulated labels" in path.read_text() for path in plots.iterdir())
    printed = capsys.readouterr().out
    assert "simulated labels" in printed and "point-robust" in printed
    assert "Leave one object out" in printed
    assert main([*arguments, "--json", "-", "--pose-error", "0.002,0.006"]) == 0
    again = json.loads(capsys.readouterr().out)
    assert again["pose_error"]["translation"] == 0.002
    assert again["models"]["reach"]["ap"] == content["models"]["reach"]["ap"]
    page = tmp_path / "docs" / "table.md"
    assert main([*arguments, "--markdown", str(page), "--pose-error", "0.002,0.006"]) == 0
    text = page.read_text()
    assert "--models reach,point-robust --pose-error 0.002,0.006 --seed 0 --markdown" in text
    assert str(tmp_path) not in text


@pytest.mark.parametrize(
    ("extra", "message"),
    [
        (["--models", "magic"], "unknown model 'magic'; valid: dynamic, ellipse"),
        (["--pose-error", "1mm"], "expected METERS,RADIANS"),
        (["--pose-error", "-0.001,0.003"], "translation error"),
        (["--backend", "mpi"], "unknown scoring backend 'mpi'"),
        (["--scheduler", "tcp://127.0.0.1:1"], "is for --backend dask"),
        (["--json", "/proc/nowhere/x.json"], "cannot write"),
        (["--markdown", "/proc/nowhere/x.md"], "cannot write"),
        (["--plots", "/proc/nowhere"], "cannot write"),
        (["--jobs", "0"], "--jobs is 0"),
    ],
)
def test_evaluate_refuses_in_one_line_before_the_work(folder, capsys, monkeypatch, extra, message):
    monkeypatch.setattr("reach.evaluation.compare.tabulate", None)
    assert main(["evaluate", str(folder), *extra]) == 2
    error = capsys.readouterr().err.strip().splitlines()[-1]
    assert error.startswith("error: ") and message in error


def test_folders_that_are_nothing_are_refused(tmp_path, capsys):
    for command in ("evaluate", "export", "report", "fit"):
        extra = ["--to", str(tmp_path / "x")] if command == "export" else []
        assert main([command, str(tmp_path / "nothing"), *extra]) == 2
        assert "does not exist" in capsys.readouterr().err


def test_export_refuses_unknown_formats_and_full_folders(folder, tmp_path, capsys):
    assert main(["export", str(folder), "--to", str(tmp_path / "x"), "--format", "excel"]) == 2
    assert "valid: acronym, csv, graspgen, isaac, parquet, reach2019" in capsys.readouterr().err
    (tmp_path / "full").mkdir()
    (tmp_path / "full" / "mine").touch()
    assert main(["export", str(folder), "--to", str(tmp_path / "full")]) == 2
    assert "not empty" in capsys.readouterr().err
    assert not (tmp_path / "x").exists()


@pytest.mark.parametrize("command", ["export", "import"])
def test_unwritable_folders_are_refused_before_the_work(folder, tmp_path, capsys, command):
    """Missing folders above a target are made; a file in the way is told at once."""
    (tmp_path / "file").touch()
    given = {
        "export": ["export", str(folder), "--to"],
        "import": ["import", "reach2019", "--grasps", "none", "--meshes", "none", "--out"],
    }[command]
    for target in (tmp_path / "file", tmp_path / "file" / "d"):
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr("logs.dataset.sources.load_labeled", None)
            patch.setattr("logs.dataset.from_reach2019.import_reach2019", None)
            assert main([*given, str(target)]) == 2
        assert "cannot write" in capsys.readouterr().err
    deep = tmp_path / "made" / "deep" / "d"
    assert main(["export", str(folder), "--to", str(deep), "--license", "MIT"]) == 0
    assert "| license | MIT |" in (deep / "README.md").read_text()


def test_export_all_then_import_again(folder, tmp_path, capsys):
    out = tmp_path / "all"
    assert main(["export", str(folder), "--to", str(out), "--format", "all", "--json"]) == 0
    manifest = json.loads(capsys.readouterr().out)
    assert manifest["trials"] == 20 and manifest["simulated"] is True
    masses = tmp_path / "grams.json"
    masses.write_text('{"part 0": 10, "part 1": 11}')
    arguments = [
        "import", "reach2019", "--grasps", str(out / "reach2019"), "--meshes", str(out / "meshes"),
        "--out", str(tmp_path / "back"), "--masses", str(masses),
    ]  # fmt: skip
    assert main(arguments) == 0
    printed = capsys.readouterr().out
    assert "part 0: 5 grasps, 10 trials" in printed and "10 g (given with --masses)" in printed
    assert main([*arguments[:1], "dexnet", *arguments[2:]]) == 2
    assert "valid: reach2019" in capsys.readouterr().err


def test_report_and_fit(folder, tmp_path, capsys):
    page = tmp_path / "sub" / "page.html"
    assert main(["report", str(folder), "--out", str(page), "--models", "reach"]) == 0
    assert capsys.readouterr().out.strip() == str(page)
    assert page.read_text().startswith("<!doctype html>")
    assert main(["fit", str(folder), "--samples", "4"]) == 0
    assert capsys.readouterr().out.startswith("simulated labels")
    assert main(["fit", str(folder), "--samples", "4", "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert set(found["parameters"]) == {"friction", "compliance", "translation"}
    assert found["registration"]["height"]["count"] == 16


def test_help_shows_examples():
    from collection.cli.main import build_app

    runner = typer.testing.CliRunner()
    for command in ("evaluate", "export", "import", "report", "fit"):
        shown = runner.invoke(build_app(), [command, "--help"])
        assert shown.exit_code == 0
        assert f"reach {command}" in shown.output
