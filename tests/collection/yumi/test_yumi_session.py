"""`reach collect` as a laboratory runs it: real driver, watched folder, wall clock, a person.

The session is a process of its own; the controller, the camera's tool and the person are here.
"""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from laboratory import LiveController, Operator, Table
from yumi_emulator import WebServices
from yumi_emulator.language import Module

from collection.objects import load_object
from collection.station.station import find_station_file, load_station
from logs.journal.events import Held, Labelled, Source, Voided
from logs.journal.file import read_journal
from logs.journal.trial_state import TrialState
from logs.record.trial_record import TrialRecord, read_record
from logs.session.folder import SessionFolder
from reach.symmetry import pose_distance, symmetry

REACH = Path(sys.executable).with_name("reach")
LONGEST = 500.0
"""For a session on a busy machine, where scoring may have to compile its kernels first [s]."""
pytestmark = pytest.mark.timeout(2 * LONGEST)


def _meet_an_obstacle(controller: LiveController) -> None:
    controller.faults.collide_at = 0.6


def _forget_the_jaws(controller: LiveController) -> None:
    controller.arms["T_ROB_R"].hand.calibrated = False


def _break_the_line(controller: LiveController) -> None:
    controller.faults.drop_after = 1


def _cut_the_line(controller: LiveController) -> None:
    controller.faults.deaf = 1_000_000


TROUBLES = {
    (1, "descend"): _meet_an_obstacle,
    (2, "close"): _forget_the_jaws,
    (3, "close"): _break_the_line,
    (3, "lift"): _cut_the_line,
}


@dataclass(frozen=True)
class Finished:
    """A session that is over."""

    folder: SessionFolder
    summary: dict[str, Any]
    told: str
    operator: Operator
    controller: LiveController

    def events(self, kind: type) -> list[Any]:
        entries = read_journal(self.folder.journal_path)
        return [entry.event for entry in entries if isinstance(entry.event, kind)]

    @property
    def trial(self) -> TrialState:
        (only,) = self.folder.read_state().order
        return only

    def record(self) -> TrialRecord:
        take = self.trial.valid_take
        assert take is not None and take.record is not None
        return read_record((self.folder.path / take.record).parent)


@pytest.fixture(scope="module")
def finished(rapid_module: Module, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Finished]:
    folder = tmp_path_factory.mktemp("laboratory")
    frames, out = folder / "frames", folder / "S"
    frames.mkdir()
    with (
        LiveController(rapid_module, TROUBLES) as controller,
        WebServices(controller) as services,
        load_station("simulated", seed=2) as scene,
    ):
        controller.arms["T_ROB_R"].hand.object_width = 30.0
        station = folder / "lab.toml"
        station.write_text(_station_file(services.address))
        with _collect(station, out) as process:
            try:
                link = _link(process)
                operator = Operator(link, out, Table(scene, frames), lambda: _mend(controller))
                operator.work(lambda: process.poll() is None, LONGEST)
                summary, told = process.communicate(timeout=LONGEST)
            finally:
                process.kill()
        assert process.returncode == 0, told
        yield Finished(SessionFolder.open(out), json.loads(summary), told, operator, controller)


def _mend(controller: LiveController) -> None:
    controller.faults.deaf = 0


def _station_file(address: str) -> str:
    """The packaged real station, its controller's address the emulator's, its looks more frequent."""
    text = find_station_file("yumi").read_text(encoding="utf-8")
    for old, new in (
        ("192.168.125.1", address),
        ("poll_interval = 0.05 ", "poll_interval = 0.01 "),
        ('calibration = "calibration.json"', "poll_interval = 0.05"),  # the frames bring the pose
    ):
        assert old in text
        text = text.replace(old, new, 1)
    return text


def _collect(station: Path, out: Path) -> subprocess.Popen[str]:
    words = "--objects cube_3cm --grasps 1 --repeats 1 --seed 5 --operator web --no-report --json"
    return subprocess.Popen(
        [REACH, "collect", "--station", station, "--out", out, *words.split()],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        env={**os.environ, "COLUMNS": "300"},
    )


def _link(process: subprocess.Popen[str]) -> str:
    """The page's address, which the session prints once it serves it."""
    assert process.stderr is not None
    told = ""
    for line in process.stderr:
        told += line
        found = re.search(r"console +(http\S+)", line)
        if found:
            return found.group(1)
    raise AssertionError(told)


def test_the_trial_is_executed_and_labelled_by_a_person(finished: Finished) -> None:
    assert (finished.summary["planned"], finished.summary["labelled"]) == (1, 1)
    assert finished.summary["simulated"] is False
    (label,) = finished.events(Labelled)
    assert label.source is Source.OPERATOR


def test_each_fault_voids_its_take_and_the_trial_is_tried_again(finished: Finished) -> None:
    voids = [event.reason.split(":")[0] for event in finished.events(Voided)]
    assert voids == ["CollisionStopError", "GripperNotCalibratedError", "ConnectionLostError"]
    assert [take.status for take in finished.trial.takes] == [*["voided"] * 3, "executed"]
    assert finished.summary["voided"] == 3


def test_a_line_that_breaks_once_disturbs_no_trial(finished: Finished) -> None:
    """Take 3: the answer to "close" was cut off after it was carried out; it is not asked again."""
    assert finished.controller.steps.count((3, "close")) == 1
    assert (3, "lift") in finished.controller.steps


def test_a_hand_without_its_zero_is_calibrated_where_it_opens(finished: Finished) -> None:
    assert finished.controller.arms["T_ROB_R"].hand.calibrations == 2  # at first, and after take 2


def test_a_dead_line_holds_the_session_until_a_person_has_mended_it(finished: Finished) -> None:
    (held,) = {hold.text for hold in finished.events(Held) if hold.cause == "station"}
    assert "does not answer" in held
    assert finished.operator.holds


def test_the_record_holds_what_the_real_devices_did(finished: Finished) -> None:
    record = finished.record()
    assert record.complete
    assert not record.descriptor.simulated
    assert record.registration is not None and record.execution is not None
    sym = symmetry(load_object("cube_3cm"))
    T_true = finished.operator.placed[-1]
    assert pose_distance(sym, T_true, record.registration.T_world_object)[1] < 3e-3
    assert "true_registration_error_translation" not in record.execution.measurements
    assert record.execution.sensor_verdict == "held"
    assert record.execution.measurements["width"] == pytest.approx(0.030)
    commanded = record.execution.T_world_gripper_commanded
    np.testing.assert_allclose(record.execution.T_world_gripper, commanded, atol=5e-4)
    heights = record.frames["gripper"].transforms()[:, 2, 3]
    assert heights.max() > heights.min() + 0.09
    assert len(record.jaw.time_ns) > 20


def test_the_robot_is_left_open_and_away_from_the_part(finished: Finished) -> None:
    arm = finished.controller.arms["T_ROB_R"]
    assert arm.hand.position == pytest.approx(25.0)
    height_mm = arm.motion.chain.forward(arm.motion.joints)[2, 3]
    assert height_mm > 300
