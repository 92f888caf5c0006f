"""A laboratory around the emulated controller: time that runs by itself, a table, a person.

The session under test is a process of its own and knows none of this: it talks to a controller,
looks into a folder, and serves a page.
"""

from __future__ import annotations

import re
import threading
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import replace
from pathlib import Path
from typing import Any

import httpx
import numpy as np
from yumi_emulator import Controller
from yumi_emulator.language import Module

from collection.cameras.frame_files import write_frame
from collection.objects import load_object
from collection.plan.records import Plan
from collection.robots.half_turn import held_alike
from collection.robots.motion import can_execute
from collection.robots.yumi.messages import Command
from collection.station.station import Station

LAPSE = 20.0
"""Seconds of the controller to one of the wall clock: its motions are long."""
LOOK = 0.03
"""Between two looks of the operator at the page [s]."""

Trouble = Callable[["LiveController"], None]


class LiveController(Controller):
    """An emulated controller whose time runs by itself, and where trouble comes on schedule.

    Args:
        module: loaded into the right arm's task.
        troubles: by take and step (`descend`, `close`, `lift`), done when the step is requested.
    """

    def __init__(self, module: Module, troubles: Mapping[tuple[int, str], Trouble]) -> None:
        super().__init__(module, sides="R")
        self.takes = 0
        self.steps: list[tuple[int, str]] = []
        self._troubles = dict(troubles)
        self._lines, self._gripped = 0, False
        self._ended = threading.Event()
        self._thread = threading.Thread(target=self._run, daemon=True)

    def __enter__(self) -> LiveController:
        self._thread.start()
        return self

    def __exit__(self, *exception: object) -> None:
        self._ended.set()
        self._thread.join()

    def write(self, task: str, name: str, text: str) -> None:
        """Take note of the step of the trial motion that is requested, then serve it."""
        found = re.match(r"\[\d+,(\d+)", text) if name == "reach_request" else None
        step = self._step_of(Command(int(found.group(1)))) if found else None
        if step is not None:
            self.steps.append((self.takes, step))
            self._troubles.pop((self.takes, step), lambda _: None)(self)
        super().write(task, name, text)

    def _step_of(self, command: Command) -> str | None:
        if command is Command.MOVE_POSE_JOINT:  # the first motion of a take, and of it alone
            self.takes += 1
            self._lines, self._gripped = 0, False
        elif command is Command.JAW_GRIP:
            self._gripped, self._lines = True, 0
            return "close"
        elif command is Command.MOVE_POSE_LINEAR:
            self._lines += 1
            return {(False, 2): "descend", (True, 1): "lift"}.get((self._gripped, self._lines))
        return None

    def _run(self) -> None:
        before = time.monotonic()
        while not self._ended.wait(0.002):
            now = time.monotonic()
            self.advance(LAPSE * (now - before))
            before = now


class Table:
    """The table with its part, seen by the simulated camera; its frames go to a folder.

    Args:
        station: the simulated station whose camera and table these are, connected.
        frames: the folder that the session under test watches.
    """

    def __init__(self, station: Station, frames: Path) -> None:
        self._station, self._frames = station, frames
        self._shots = 0
        self._rng = np.random.default_rng(1)

    def place(self, plan: Plan, trial_id: str) -> np.ndarray:
        """Put a trial's part where the arm reaches its grasp; returns the true pose (4, 4)."""
        trial = next(each for each in plan.trials if each.trial_id == trial_id)
        grasp = plan.grasp(trial.grasp_id)
        arm, simulation = self._station.arm, self._station.simulation
        hand = self._station.gripper.geometry
        assert simulation is not None
        simulation.place(
            load_object(trial.object_name),
            plan.pose_of(grasp),
            self._rng,
            accept=lambda T: can_execute(arm, held_alike(hand, T @ grasp.T_object_gripper)),
        )
        return np.array(simulation.true_T_world_object())

    def shoot(self) -> None:
        """Take an image, as the camera's own tool does, and drop it into the folder."""
        frame = replace(self._station.camera.capture(), time_ns=time.time_ns())
        self._shots += 1
        path = self._frames / f"frame_{self._shots:04d}.npz"
        write_frame(path, frame, T_world_camera=frame.T_world_camera)


class Operator:
    """A person at the page, by what the page itself asks and sends.

    Args:
        link: as the session prints it, with the token.
        out: the session's folder.
        table: where parts are placed.
        repair: what is done at the robot when the session is held.
    """

    def __init__(self, link: str, out: Path, table: Table, repair: Callable[[], None]) -> None:
        address, token = link.split("/#token=")
        self._client = httpx.Client(
            base_url=address, headers={"Authorization": f"Bearer {token}"}, trust_env=False
        )
        self._out, self._table, self._repair = out, table, repair
        self.placed: list[np.ndarray] = []
        self.holds: list[str] = []

    def work(self, running: Callable[[], bool], seconds: float) -> None:
        """Do what the page asks for until the session is over."""
        with self._client, self._page_open():
            for view in self._views(running, time.monotonic() + seconds):
                self._act(view)

    @contextmanager
    def _page_open(self) -> Iterator[None]:
        """The page tells that it is there, also while the person is busy at the table."""
        closed = threading.Event()

        def tell() -> None:
            while not closed.wait(1.0):
                with suppress(httpx.TransportError):  # the session is over
                    self._client.post("/api/alive", json={})

        thread = threading.Thread(target=tell, daemon=True)
        thread.start()
        try:
            yield
        finally:
            closed.set()
            thread.join()

    def _views(self, running: Callable[[], bool], deadline: float) -> Iterator[dict[str, Any]]:
        while running():
            assert time.monotonic() < deadline, "the session did not end in time"
            try:
                view = self._client.get("/api/view").json()
            except httpx.TransportError:
                return  # the page closes with the session
            if view["state"] == "ENDED":
                return
            yield view
            time.sleep(LOOK)

    def _act(self, view: dict[str, Any]) -> None:
        trial, state = view["trial"], view["state"]
        if "station" in view["holds"]:
            self.holds.append(view["holds"]["station"])
            self._repair()
        if "station" in view["holds"] or view["paused"]:
            self._send(view, "resume")
        elif state == "PLACE_OBJECT" and not trial["placed"]:
            plan = Plan.from_json((self._out / "plan.json").read_text())
            self.placed.append(self._table.place(plan, trial["trial_id"]))
            self._send(view, "placed", trial)
        elif state == "CAPTURE":
            self._table.shoot()
        elif state == "CONFIRM_POSE":
            self._send(view, "accept_pose", trial, rival=0)
        elif state == "AWAITING_LABEL":
            self._send(view, "label", trial, outcome="success")

    def _send(
        self, view: dict[str, Any], kind: str, trial: dict[str, Any] | None = None, **value: Any
    ) -> None:
        body = {
            "kind": kind,
            "trial_id": trial["trial_id"] if trial else None,
            "rev": trial["rev"] if trial else view["control_rev"],
            "value": value,
            "tick": self._client.get("/api/view").json()["tick"],  # placing takes its time
        }
        answer = self._client.post("/api/commands", json=body)
        answer.raise_for_status()
        # What changed meanwhile makes a command stale: the next look shows what is due.
        assert answer.json()["status"] in ("stored", "stale"), answer.text
