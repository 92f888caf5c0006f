"""Bad input gets one clear line, exit code 2, and nothing is written; help is fast."""

import os
import subprocess
import sys
from importlib import metadata
from pathlib import Path

import pytest
import trimesh

from collection.cli.main import COMMANDS, main

REACH = Path(sys.executable).with_name("reach")


def refused(capsys, *arguments):
    assert main(list(map(str, arguments))) == 2
    err = capsys.readouterr().err
    assert err.startswith("error: ")
    assert err.count("\n") == 1, err
    return err


def collect(out, **options):
    given = {"objects": "cube_3cm", "grasps": "1", "repeats": "1", "operator": "auto"} | options
    words = [w for k, v in given.items() for w in (f"--{k.replace('_', '-')}", str(v))]
    return ["collect", *words, "--out", out]


@pytest.mark.parametrize(
    ("options", "named"),
    [
        ({"objects": "cubee"}, ["cubee", "bracket"]),
        ({"objects": "nowhere.stl"}, ["nowhere.stl"]),
        ({"objects": ""}, ["--objects", "cube_3cm"]),
        ({"station": "mars"}, ["mars", "simulated"]),
        ({"operator": "robot"}, ["robot", "'auto', 'web' or 'terminal'"]),
        ({"grasps": "0"}, ["--grasps", "0"]),
        ({"grasps": "many"}, ["many"]),
        ({"seed": "-3"}, ["--seed", "-3"]),
        ({"mesh_unit": "furlong"}, ["furlong", "mm"]),
        ({"accept_change": "calibration"}, ["--resume"]),
        ({"models": "reach,guess"}, ["--models", "guess", "settled-robust"]),
        ({"min_probability": "1.5"}, ["--min-probability", "1.5"]),
        ({"operator": "web", "host": "0.0.0.0"}, ["0.0.0.0", "token"]),
        ({"station": "yumi"}, ["auto", "yumi", "web"]),
    ],
)
def test_bad_input_is_refused_in_one_line(capsys, tmp_path, options, named):
    out = tmp_path / "S"
    line = refused(capsys, *collect(out, **options))
    for word in named:
        assert word in line
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    "command",
    [["score", "--mesh", "cube_3cm", "--grasps", "none"], ["evaluate", "D"], ["report", "D"]],
)
def test_models_that_name_none_are_refused(capsys, command):
    assert "--models ',' names none; valid: point" in refused(capsys, *command, "--models", ",")


def test_what_no_memory_holds_is_refused_in_one_line(capsys, monkeypatch):
    def too_many(*_: object, **__: object) -> None:
        raise MemoryError("Unable to allocate 745. GiB")

    monkeypatch.setattr("collection.sampling.over_poses.sample_over_poses", too_many)
    assert "not enough memory" in refused(capsys, "sample", "--mesh", "cube_3cm")


def test_a_dry_run_refuses_what_the_session_would_refuse(capsys, tmp_path):
    assert "yumi" in refused(capsys, *collect(tmp_path / "S", station="yumi"), "--dry-run")
    assert "exists" in refused(capsys, *collect(tmp_path), "--dry-run")
    assert "status" in refused(capsys, *collect(tmp_path), "--dry-run", "--resume")


def test_an_existing_folder_is_not_written_to(capsys, tmp_path):
    (tmp_path / "kept").write_text("mine")
    line = refused(capsys, *collect(tmp_path))
    assert "--resume" in line or "exists" in line
    assert [p.name for p in tmp_path.iterdir()] == ["kept"]


def test_a_cube_of_thirty_meters_is_taken_for_millimeters(capsys, tmp_path):
    mesh = tmp_path / "cube.stl"
    trimesh.creation.box((30, 30, 30)).export(mesh)
    assert "--mesh-unit mm" in refused(capsys, *collect(tmp_path / "S", objects=mesh))


def test_a_part_that_no_jaw_can_hold_is_refused_with_the_reason(capsys, tmp_path):
    mesh = tmp_path / "block.stl"
    trimesh.creation.box((0.09, 0.09, 0.09)).export(mesh)
    line = refused(capsys, *collect(tmp_path / "S", objects=mesh))
    assert "block" in line
    assert not (tmp_path / "S").exists()


def test_an_open_mesh_is_refused(capsys, tmp_path):
    mesh = tmp_path / "open.stl"
    box = trimesh.creation.box((0.03, 0.03, 0.03))
    box.update_faces([True] * 6 + [False] * 6)
    box.export(mesh)
    assert "watertight" in refused(capsys, *collect(tmp_path / "S", objects=mesh))


@pytest.mark.parametrize(
    ("words", "named"),
    [
        ("objects cube_3cm --wall nan", ["wall", "nan"]),
        ("objects cube_3cm --wall -1", ["wall", "-0.001"]),
        ("label S --json", ["--json", "--agreement"]),
        ("fit S --model point", ["point", "settled-robust"]),
    ],
)
def test_options_that_mean_nothing_are_refused(capsys, words, named):
    line = refused(capsys, *words.split())
    for word in named:
        assert word in line


@pytest.mark.parametrize("command", ["status", "replay", "recover"])
def test_no_session_there(capsys, tmp_path, command):
    assert "session" in refused(capsys, command, tmp_path / "nothing")


def test_a_missing_system_library_is_named(capsys, tmp_path, monkeypatch):
    def without(*_, **__):
        raise ImportError("libEGL.so.1: cannot open shared object file: No such file or directory")

    monkeypatch.setattr("collection.objects.load_objects", without)
    line = refused(capsys, "objects", "--export", tmp_path / "D")
    assert "libEGL.so.1" in line and "install-system-packages" in line


def test_unknown_commands_and_options(capsys):
    line = refused(capsys, "fly")
    assert "fly" in line
    assert all(name in line for name in COMMANDS)
    assert "--wings" in refused(capsys, "status", "--wings")


def test_help_names_every_command(capsys):
    assert main(["--help"]) == 0
    told = capsys.readouterr().out
    assert all(name in told for name in COMMANDS)


@pytest.mark.parametrize("out", ["/proc/nowhere/S", "/dev/null/S"])
def test_a_folder_that_cannot_be_written_is_named(capsys, out):
    assert out.rpartition("/")[0] in refused(capsys, *collect(out))


def test_objects_are_not_exported_below_a_file(capsys, tmp_path):
    (tmp_path / "file").write_text("")
    assert str(tmp_path / "file") in refused(capsys, "objects", "--export", tmp_path / "file" / "x")


def test_version_is_printed(capsys):
    assert main(["--version"]) == 0
    assert capsys.readouterr().out.startswith(f"reach-trials {metadata.version('reach-trials')}")


def test_an_interrupted_command_says_so(capsys, monkeypatch):
    def interrupted(*_, **__):
        raise KeyboardInterrupt

    monkeypatch.setattr("collection.objects.load_objects", interrupted)
    assert main(["objects"]) == 130
    assert capsys.readouterr().err == "error: interrupted\n"


@pytest.mark.parametrize("words", ["--help", "collect --help", "objects", "objects --json"])
def test_a_reader_who_has_seen_enough_is_no_fault(words):
    reading, writing = os.pipe()
    os.close(reading)
    with os.fdopen(writing, "wb") as nobody:
        done = subprocess.run([REACH, *words.split()], stdout=nobody, stderr=subprocess.PIPE)
    assert (done.returncode, done.stderr) == (0, b"")


@pytest.mark.parametrize("arguments", [["--help"], ["status", "--help"]])
def test_help_imports_nothing_heavy(arguments):
    heavy = ["numpy", "open3d", "trimesh", "rerun", "pandas", "numba", "mujoco", "matplotlib"]
    code = (
        "import sys; from collection.cli.main import main; main(sys.argv[1:]);"
        f"print('HEAVY', [m for m in {heavy} if m in sys.modules])"
    )
    done = subprocess.run(
        [sys.executable, "-c", code, *arguments], capture_output=True, text=True, env=os.environ
    )
    assert "HEAVY []" in done.stdout
