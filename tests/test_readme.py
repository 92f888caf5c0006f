"""What the README shows works: its library lines run, its commands exist with those options."""

import re
import shlex
from pathlib import Path

import numpy as np
import pytest
import trimesh
import typer

from collection.cli.main import COMMANDS, build_app

README = (Path(__file__).resolve().parent.parent / "README.md").read_text()
PYTHON = re.search(r"```python\n(.*?)```", README, re.DOTALL)[1]
LINES = [line for text in re.findall(r"`(reach [^`]+)`", README) for line in [text]]


def test_the_library_lines_run(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    trimesh.creation.box((0.02, 0.03, 0.04)).export("bracket.stl")
    T_world_object = np.eye(4)
    T_world_object[2, 3] = 0.02
    T_object_gripper = np.diag([1.0, -1.0, -1.0, 1.0])
    T_object_gripper[2, 3] = 0.16
    names = {"T_world_object": T_world_object, "T_object_gripper": T_object_gripper}
    exec(compile(PYTHON, "README.md", "exec"), names)
    assert names["verdict"].resists
    assert names["verdict"].patches
    assert names["q"].value > 0.9


@pytest.mark.parametrize("line", LINES)
def test_the_commands_exist_with_their_options(line):
    words = shlex.split(line.partition(">")[0])[1:]
    command = typer.main.get_command(build_app()).commands[words[0]]
    known = {option for parameter in command.params for option in parameter.opts}
    assert {word for word in words if word.startswith("--")} <= known


def test_every_command_is_told_of():
    assert {name for name in COMMANDS if f"`reach {name}" not in README} <= {
        "console",
        "recover",
        "fit",
    }
