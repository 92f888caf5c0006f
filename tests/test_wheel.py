"""The wheel holds the five packages, and works in an environment that has nothing else."""

import os
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parent.parent


def run(*command: object, cwd: Path) -> str:
    clean = {k: v for k, v in os.environ.items() if not k.startswith(("PYTHON", "VIRTUAL_ENV"))}
    done = subprocess.run(
        [str(part) for part in command], cwd=cwd, env=clean, capture_output=True, text=True
    )
    assert done.returncode == 0, done.stderr
    return done.stdout


@pytest.fixture(scope="module")
def wheel(tmp_path_factory):
    """Build from a copy of the tracked files, so that no build folder is left in the checkout."""
    source = tmp_path_factory.mktemp("source")
    tracked = run("git", "ls-files", "-z", cwd=ROOT).split("\0")
    for name in filter(None, tracked):
        if (ROOT / name).is_file():
            (source / name).parent.mkdir(parents=True, exist_ok=True)
            (source / name).write_bytes((ROOT / name).read_bytes())
    out = tmp_path_factory.mktemp("wheel")
    run(sys.executable, "-m", "uv", "build", "--quiet", "--wheel", "--out-dir", out, cwd=source)
    return next(out.glob("reach_trials-*.whl"))


def test_the_wheel_holds_the_rooms_and_their_data_but_no_tests(wheel):
    names = zipfile.ZipFile(wheel).namelist()
    rooms = {name.split("/")[0] for name in names if "dist-info" not in name}
    assert rooms == {"reach", "registration", "labeling", "logs", "collection"}
    tracked = run("git", "ls-files", "--", *sorted(rooms), cwd=ROOT).split()
    missing = [name for name in tracked if name not in names]
    assert not missing, "list these in pyproject's packages or package-data"


def test_reach_help_runs_from_the_wheel_in_an_empty_environment(wheel, tmp_path):
    run(
        sys.executable,
        "-m",
        "uv",
        "venv",
        "--quiet",
        "--python",
        sys.executable,
        "env",
        cwd=tmp_path,
    )
    python = tmp_path / "env/bin/python"
    run(
        sys.executable, "-m", "uv", "pip", "install", "--quiet", "--python", python,
        "--constraint", ROOT / "constraints.txt", wheel, cwd=tmp_path,
    )  # fmt: skip
    assert "collect" in run(tmp_path / "env/bin/reach", "--help", cwd=tmp_path)
