"""Stop, pressed at the console in any step of a session: nothing moves until it is cleared there."""

from __future__ import annotations

import threading
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from collection import trial as trial_module
from collection.cli.main import main
from collection.robots.simulated_arm import SimulatedArm
from collection.session.session import Session
from labeling.control.commands import Actor, Command, CommandKind
from labeling.control.controller import SessionController
from logs.journal.events import Source
from logs.session.folder import SessionFolder
from registration.errors import NoGoodPoseError

ANN = Actor("ann", Source.OPERATOR)
PATIENCE = 0.3
"""So long nobody clears the stop, while the session's loop could do something [s]."""


class Console:
    """Presses stop when told, and clears it from another thread, as a person would.

    Args:
        monkeypatch: to look at the session that the command line makes, and at its arm.
    """

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        self._controller: SessionController | None = None
        self.moved_while_stopped: list[str] = []
        self.presses = 0
        run = Session.run

        def watched(session: Session) -> None:
            self._controller = session.controller
            run(session)

        monkeypatch.setattr(Session, "run", watched)
        execute = SimulatedArm._execute

        def moving(arm: Any, *args: Any, **options: Any) -> Any:
            assert self._controller is not None
            with self._controller.reading() as state:
                if state.stopped:
                    self.moved_while_stopped.append("arm")
            return execute(arm, *args, **options)

        monkeypatch.setattr(SimulatedArm, "_execute", moving)

    def press(self) -> None:
        assert self._controller is not None
        self.presses += 1
        self._controller.submit(Command(kind=CommandKind.STOP, rev=0, value={}), ANN)
        threading.Timer(PATIENCE, self._clear).start()

    def _clear(self) -> None:
        controller = self._controller
        assert controller is not None
        with controller.reading() as state:
            rev = state.control_rev
        value = {"confirm": True}
        controller.submit(Command(kind=CommandKind.CLEAR_STOP, rev=rev, value=value), ANN)


def collect(out: Path) -> int:
    words = "--station simulated --objects cube_3cm --grasps 1 --repeats 1 --seed 8"
    return main(["collect", *words.split(), "--operator", "auto", "--out", str(out), "--no-report"])


def once(act: Callable[[], None]) -> Callable[[], None]:
    """Act at the first call, and never again."""
    left = [act]
    return lambda: left.pop()() if left else None


def test_a_stop_while_the_part_is_registered_stands_though_registration_fails(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    console = Console(monkeypatch)
    register = trial_module.register
    press = once(console.press)

    def failing(*args: Any, **options: Any) -> Any:
        press()
        if console.presses and len(failures) == 0:
            failures.append(1)
            raise NoGoodPoseError("clutter")
        return register(*args, **options)

    failures: list[int] = []
    monkeypatch.setattr(trial_module, "register", failing)
    assert collect(tmp_path / "S") == 0
    assert console.presses == 1
    assert console.moved_while_stopped == []
    assert SessionFolder.open(tmp_path / "S").read_state().counts().labelled == 1


@pytest.mark.parametrize("step", ["_place", "_capture", "_execute"])
def test_a_stop_in_any_step_of_a_take_stands(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, step: str
) -> None:
    console = Console(monkeypatch)
    press = once(console.press)
    do = getattr(trial_module, step)

    def stopped(*args: Any) -> Any:
        press()
        return do(*args)

    monkeypatch.setattr(trial_module, step, stopped)
    assert collect(tmp_path / "S") == 0
    assert console.moved_while_stopped == []
    assert SessionFolder.open(tmp_path / "S").read_state().counts().labelled == 1


@pytest.mark.parametrize("device_call", ["clear_error", "pose", "move_to_pose", "home"])
def test_a_stop_in_a_recovery_stands_and_the_session_goes_on_when_it_is_cleared(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, device_call: str
) -> None:
    """A scripted collision brings the recovery; the stop falls into it."""
    from importlib import resources

    text = (
        resources.files("collection.station").joinpath("simulated.toml").read_text(encoding="utf-8")
    )
    station = tmp_path / "lab.toml"
    station.write_text(text + '\n[[simulation.faults]]\nkind = "collision_stop"\nattempt = 1\n')
    console = Console(monkeypatch)
    press = once(console.press)
    recovering: list[bool] = []
    recover, call = Session._recover, getattr(SimulatedArm, device_call)

    def in_recovery(session: Session) -> None:
        recovering.append(True)
        try:
            recover(session)
        finally:
            recovering.clear()

    def stopped(arm: SimulatedArm, *args: Any, **options: Any) -> Any:
        if recovering:
            press()
        return call(arm, *args, **options)

    monkeypatch.setattr(Session, "_recover", in_recovery)
    monkeypatch.setattr(SimulatedArm, device_call, stopped)
    words = f"--station {station} --objects cube_3cm --grasps 1 --repeats 1 --seed 8"
    out = tmp_path / "S"
    assert (
        main(["collect", *words.split(), "--operator", "auto", "--out", str(out), "--no-report"])
        == 0
    )
    assert console.presses == 1
    assert console.moved_while_stopped == []
    assert SessionFolder.open(out).read_state().counts().labelled == 1
