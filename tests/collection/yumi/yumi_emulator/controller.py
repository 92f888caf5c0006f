"""The emulated controller: state, tasks, time, event log; no network."""

from __future__ import annotations

import threading
from dataclasses import dataclass
from typing import Any

import numpy as np

from yumi_emulator.arm import ArmMotion, ProgramStopError
from yumi_emulator.faults import Faults
from yumi_emulator.hand import Hand
from yumi_emulator.interpreter import Task
from yumi_emulator.kinematics import Vector
from yumi_emulator.language import Module, parse_expression
from yumi_emulator.runtime import Arguments, RapidError, Run
from yumi_emulator.values import Record, Types, to_text

ERRORS = (
    "ERR_ROBLIMIT ERR_OUTSIDE_REACH ERR_COLL_STOP ERR_HAND_NOTCALIBRATED ERR_HAND_WRONGSTATE "
    "ERR_HAND_FAILEDGRIPPOS ERR_HAND_FAILEDMOVEPOS"
).split()
STEP = 0.01
"""Time between two looks of the program [s]."""


@dataclass(frozen=True)
class Event:
    number: int
    code: int
    kind: int
    title: str


class Arm:
    """One arm with its hand and the task that runs them; the task's built-in routines.

    Args:
        controller: whose clock and faults apply.
        side: `R` or `L`.
        module: loaded into the task.
    """

    def __init__(self, controller: Controller, side: str, module: Module) -> None:
        self.side, self.faults = side, controller.faults
        self.hand = Hand(lambda: controller.time, controller.faults)
        self.motion = ArmMotion(side, lambda: controller.time, controller.faults)
        self.procedures = self.motion.procedures | self.hand.procedures
        self.procedures["waittime"] = self._wait
        self.functions = self.motion.functions | self.hand.functions
        self.constants = _constants()
        self.shared = controller.shared
        self._controller = controller
        self.task = Task(f"T_ROB_{side}", module, self)
        self._past: list[tuple[float, Vector]] = []
        self._frozen_joint_7: float | None = None

    def now(self) -> float:
        """Time of the controller [s]."""
        return self._controller.time

    def _wait(self, arguments: Arguments) -> Run:
        end = self._controller.time + arguments.positional[0]
        while self._controller.time < end:
            yield

    def remember(self) -> None:
        """Keep the joints of this moment, for feedback that lags."""
        self._past.append((self._controller.time, self.motion.joints.copy()))
        del self._past[:-1000]

    def observed_joints(self) -> Vector:
        """The joints as the controller knows them: they may lag."""
        due = self._controller.time - self.faults.feedback_lag
        older = [past for time, past in self._past if time <= due]
        return np.array(older[-1] if older else self._past[0][1])

    def reported_joints(self) -> Vector:
        """What jointtarget says: it may have a stale joint 7 besides."""
        joints = self.observed_joints()
        if not self.faults.freeze_joint_7:
            self._frozen_joint_7 = None
        elif self._frozen_joint_7 is None:
            self._frozen_joint_7 = float(joints[6])
        if self._frozen_joint_7 is not None:
            joints[6] = self._frozen_joint_7
        return joints


class Controller:
    """An IRC5 with one or two arms, its program loaded and running in automatic mode.

    Time moves only by `advance`, so a test that injects its clock never sleeps.

    Args:
        module: parsed RAPID module, loaded into every arm's task.
        sides: of the arms.
    """

    def __init__(self, module: Module, sides: str = "RL") -> None:
        self.lock = threading.RLock()
        self.time = 0.0
        self.faults = Faults()
        self.shared: dict[str, Any] = {}
        self.mode, self.state, self.running = "AUTO", "motoron", True
        self.events: list[Event] = []
        self.arms = {f"T_ROB_{side}": Arm(self, side, module) for side in sides}
        self._wake = {name: 0.0 for name in self.arms}
        self._step_tasks()

    def advance(self, seconds: float) -> None:
        """Let time pass: arms move, programs run."""
        with self.lock:
            end = self.time + seconds
            while self.time < end - 1e-12:
                self.time = min(end, self.time + STEP)
                self._step_tasks()

    def read(self, task: str, name: str) -> str:
        return to_text(self.arms[task].task.read(name))

    def write(self, task: str, name: str, text: str) -> None:
        target = self.arms[task].task
        target.write(name, target.constant(parse_expression(text)))
        self._wake[task] = self.time + self.faults.task_delay

    def start(self) -> bool:
        """Start the programs; whether the controller was willing."""
        self.running = self.mode == "AUTO" and self.state == "motoron"
        return self.running

    def stop(self) -> None:
        self.running = False

    def reset_pointers(self) -> None:
        for arm in self.arms.values():
            arm.motion.stopped = False
            arm.task.reset()

    def emergency_stop(self) -> None:
        self.state, self.running = "emergencystop", False
        self.log(10013, 2, "Emergency stop state")

    def log(self, code: int, kind: int, title: str) -> None:
        self.events.append(Event(len(self.events) + 1, code, kind, title))

    def _step_tasks(self) -> None:
        for name, arm in self.arms.items():
            if self.running and not self.faults.hang and self.time >= self._wake[name]:
                self._step(arm)
            arm.remember()

    def _step(self, arm: Arm) -> None:
        try:
            arm.task.step()
        except RapidError as error:
            self._program_stops(40000, f"Unhandled {error.name}")
        except ProgramStopError as error:
            self._program_stops(error.code, error.title)

    def _program_stops(self, code: int, title: str) -> None:
        self.running = False
        self.log(code, 3, title)


def _constants() -> dict[str, Any]:
    types = Types({})
    fine = types.typed("zonedata", [True] + [0.0] * 6)
    errors: dict[str, Any] = {name.lower(): 1000.0 + i for i, name in enumerate(ERRORS)}
    nowhere: Record = types.default("pose")
    return errors | {"fine": fine, "wobj0": nowhere, "tool0": nowhere}
