"""What the web services' paths mean: reads and commands of the emulated controller."""

from __future__ import annotations

import re
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from yumi_emulator.controller import Arm, Controller
from yumi_emulator.values import RapidTypeError

States = list[dict[str, Any]]
FAR = "8999999488"
"""What the web services write for an axis that is not there."""


class HttpError(Exception):
    def __init__(self, status: int, code: int, message: str) -> None:
        super().__init__(message)
        self.status, self.code, self.message = status, code, message


class Resources:
    """Maps a path to a reading or a command; commands answer None (no content)."""

    def __init__(self, controller: Controller) -> None:
        self.controller = controller
        self.signals: dict[str, str] = {}

    def serve(
        self, method: str, path: str, query: dict[str, str], form: dict[str, str]
    ) -> States | None:
        if method == "POST":
            self._command(path, query.get("action", ""), form)
            return None
        return self._read(path)

    def _read(self, path: str) -> States:
        controller = self.controller
        if path == "rw/panel/ctrlstate":
            return [{"_type": "pnl-ctrlstate", "ctrlstate": controller.state}]
        if path == "rw/panel/opmode":
            return [{"_type": "pnl-opmode", "opmode": controller.mode}]
        if path == "rw/rapid/execution":
            execution = "running" if controller.running else "stopped"
            return [
                {"_type": "rap-execution", "ctrlexecstate": execution, "cycle": "forever"},
            ]
        if path == "rw/rapid/tasks":
            return [self._task(name) for name in controller.arms]
        if path.startswith("rw/elog/0"):
            return [_event(event) for event in reversed(controller.events)]
        if found := re.fullmatch(r"rw/motionsystem/mechunits/ROB_([RL])/(\w+)", path):
            return [self._motion(found.group(1), found.group(2))]
        if found := re.fullmatch(r"rw/rapid/symbol/data/RAPID/(\w+)/(?:(\w+)/)?(\w+)", path):
            return [{"_type": "rap-data", "value": self._symbol(*found.groups())}]
        if found := re.fullmatch(r"rw/iosystem/signals/(.+)", path):
            value = self.signals.get(found.group(1), "0")
            return [{"_type": "ios-signal", "lvalue": value}]
        raise HttpError(404, -1073445865, f"no resource {path}")

    def _command(self, path: str, action: str, form: dict[str, str]) -> None:
        controller = self.controller
        if controller.mode != "AUTO":
            raise HttpError(403, -1073445859, "Operation is only allowed in automatic mode")
        if path == "rw/panel/ctrlstate" and action == "setctrlstate":
            self._set_state(form["ctrl-state"])
        elif path == "rw/rapid/execution" and action == "start":
            if not controller.start():
                raise HttpError(403, -1073442801, "Motors are off")
        elif path == "rw/rapid/execution" and action == "stop":
            controller.stop()
        elif path == "rw/rapid/execution" and action == "resetpp":
            if controller.running:
                raise HttpError(403, -1073442809, "Not allowed while the program runs")
            controller.reset_pointers()
        elif path.startswith("rw/rapid/symbol/data/RAPID/") and action == "set":
            self._set_symbol(path.removeprefix("rw/rapid/symbol/data/RAPID/"), form["value"])
        elif path.startswith("rw/iosystem/signals/") and action == "set":
            self.signals[path.removeprefix("rw/iosystem/signals/")] = form["lvalue"]
        else:
            raise HttpError(404, -1073445865, f"no resource {path}?action={action}")

    def _set_state(self, state: str) -> None:
        if self.controller.state == "emergencystop":
            raise HttpError(403, -1073445862, "Emergency stop")
        self.controller.state = state
        if state != "motoron":
            self.controller.stop()

    def _arm(self, task: str, module: str | None) -> Arm:
        arm = self.controller.arms.get(task)
        if arm is None or (module and module.lower() != arm.task.module.name):
            raise HttpError(404, -1073445865, f"no symbol in {task}/{module}")
        return arm

    def _symbol(self, task: str, module: str | None, name: str) -> str:
        self._arm(task, module)
        try:
            return self.controller.read(task, name)
        except KeyError:
            raise HttpError(404, -1073445865, f"no symbol {name}") from None

    def _set_symbol(self, path: str, value: str) -> None:
        task, *module, name = path.split("/")
        self._arm(task, module[0] if module else None)
        try:
            self.controller.write(task, name, value)
        except KeyError:
            raise HttpError(404, -1073445865, f"no symbol {name}") from None
        except RapidTypeError as error:
            raise HttpError(400, -1073442814, str(error)) from error

    def _task(self, name: str) -> dict[str, Any]:
        return {
            "_type": "rap-task",
            "_title": name,
            "name": name,
            "type": "norm",
            "taskstate": "link",
            "excstate": "star" if self.controller.running else "stop",
            "active": "On",
            "motiontask": "TRUE",
        }

    def _motion(self, side: str, what: str) -> dict[str, Any]:
        arm = self.controller.arms.get(f"T_ROB_{side}")
        if arm is None:
            raise HttpError(404, -1073445865, f"no mechanical unit ROB_{side}")
        if what == "jointtarget":
            return _joint_target(np.degrees(arm.reported_joints()))
        if what == "robtarget":
            return _rob_target(arm)
        raise HttpError(404, -1073445865, f"no resource {what}")


def _joint_target(degrees: Any) -> dict[str, Any]:
    axes = {f"rax_{i + 1}": f"{degrees[i]:.6f}" for i in range(6)}
    absent = dict.fromkeys((f"eax_{letter}" for letter in "bcdef"), FAR)
    return {"_type": "ms-jointtarget", **axes, "eax_a": f"{degrees[6]:.6f}", **absent}


def _rob_target(arm: Arm) -> dict[str, Any]:
    joints, chain = arm.observed_joints(), arm.motion.chain
    T = chain.forward(joints)
    quat = Rotation.from_matrix(T[:3, :3]).as_quat(scalar_first=True)
    angle = np.degrees(chain.arm_angle(joints))
    return {
        "_type": "ms-robtargets",
        **{axis: f"{value:.6f}" for axis, value in zip("xyz", T[:3, 3], strict=True)},
        **{f"q{i + 1}": f"{value:.9f}" for i, value in enumerate(quat)},
        **dict.fromkeys(("cf1", "cf4", "cf6", "cfx"), "0"),
        "eaxa": f"{angle:.6f}",
        **dict.fromkeys((f"eax{letter}" for letter in "bcdef"), FAR),
    }


def _event(event: Any) -> dict[str, Any]:
    return {
        "_type": "elog-message",
        "_title": f"/rw/elog/0/{event.number}",
        "msgtype": str(event.kind),
        "code": str(event.code),
        "tstamp": "2019-11-22 T  12:00:00",
        "argc": "0",
        "title": event.title,
        **dict.fromkeys(("desc", "conseqs", "causes", "actions"), ""),
    }
