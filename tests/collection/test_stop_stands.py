"""An operator's stop, pressed anywhere in a trial's motion or in a recovery, stands."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np
import pytest
import trimesh

from collection.errors import CollisionStopError, StoppedError
from collection.robots.execution import Phase, PhaseEvent, TraceSample
from collection.robots.motion import execute_grasp, recover
from collection.robots.protocol import Speed
from collection.station.station import Station, load_station
from reach.objects import GraspObject
from reach.stable_poses import StablePose
from reach.transforms import make_transform

MESH = trimesh.creation.box((0.03, 0.03, 0.03))
CUBE = GraspObject("cube", MESH.vertices, MESH.faces, 0.01)
RESTING = StablePose(0, 1.0, make_transform(None, (0, 0, 0.015)))
FROM_ABOVE = make_transform(np.diag([1.0, -1.0, -1.0]), (0, 0, 0.160098))
PHASES = [phase for phase in Phase if phase is not Phase.SHAKE]

READ = [Phase.APPROACH, Phase.DESCEND, Phase.CLOSE, Phase.LIFT, Phase.RELEASE]
"""Where arm or hand move, and are read."""


@pytest.fixture(scope="module")
def station() -> Iterator[Station]:
    with load_station("simulated", seed=4) as each:
        yield each


@pytest.fixture
def T_grasp(station: Station) -> Iterator[np.ndarray]:
    assert station.simulation is not None
    station.simulation.place(CUBE, RESTING, np.random.default_rng(0))
    yield np.array(station.simulation.true_T_world_object() @ FROM_ABOVE)
    station.arm.release_stop()
    recover(station.arm, station.gripper)


def where(station: Station) -> np.ndarray:
    """The arm's commanded joints and the jaws' true opening, read without the devices."""
    assert station.simulation is not None and station.simulation.joints is not None
    return np.append(station.simulation.joints, station.simulation.opening)


def assert_nothing_moves(station: Station) -> None:
    """Whatever motion code tries, and however much time passes."""
    stopped_at = where(station)
    for attempt in (
        station.arm.clear_error,
        station.gripper.open,
        lambda: recover(station.arm, station.gripper),
        lambda: station.arm.home(speed=Speed(0.3)),
    ):
        with pytest.raises(StoppedError):
            attempt()
    station.clock.sleep(2.0)
    np.testing.assert_allclose(where(station)[:7], stopped_at[:7], atol=0)
    assert where(station)[7] == pytest.approx(stopped_at[7], abs=1e-3)  # pads give way
    assert not station.arm.state().ready


@pytest.mark.parametrize(
    ("phase", "when"),
    [(phase, "as it begins") for phase in PHASES] + [(phase, "in it") for phase in READ],
)
def test_a_stop_in_any_phase_of_the_motion_stands(
    station: Station, T_grasp: np.ndarray, phase: Phase, when: str
) -> None:
    present: list[Phase] = []
    at: list[np.ndarray] = []

    def press() -> None:
        if not at:
            at.append(where(station))
            station.arm.stop()

    def on_event(event: PhaseEvent) -> None:
        present.append(event.phase)
        if when == "as it begins" and event.phase is phase:
            press()

    def on_sample(_: TraceSample) -> None:
        if when == "in it" and present[-1] is phase:
            press()

    def run() -> None:
        execute_grasp(
            station.arm,
            station.gripper,
            T_grasp,
            station.clock,
            on_event=on_event,
            on_sample=on_sample,
        )

    with pytest.raises(StoppedError):
        run()
    assert present[-1] in (phase, following(phase))
    assert np.abs(where(station)[:7] - at[0][:7]).max() < 1e-9
    assert_nothing_moves(station)


def following(phase: Phase) -> Phase:
    """A stop after the last motion of a phase is met by the next one's."""
    return PHASES[min(PHASES.index(phase) + 1, len(PHASES) - 1)]


class Pressing:
    """A device on which the operator presses stop just before, or just after, the n-th command.

    Args:
        device: arm or hand.
        station: whose stop is pressed.
        countdown: commands left, shared by both devices.
    """

    COMMANDS = ("clear_error", "pose", "move_to_pose", "state", "calibrate", "open", "home")

    def __init__(self, device: object, station: Station, countdown: list[int], late: bool) -> None:
        self._device, self._station, self._late = device, station, late
        self._countdown = countdown

    def __getattr__(self, name: str) -> object:
        attribute = getattr(self._device, name)
        return self._counted(attribute) if name in self.COMMANDS else attribute

    def _counted(self, command: Callable[..., object]) -> Callable[..., object]:
        def call(*args: object, **options: object) -> object:
            self._countdown[0] -= 1
            due = self._countdown[0] == 0
            if due and not self._late:
                self._station.arm.stop()
            try:
                return command(*args, **options)
            finally:
                if due and self._late:
                    self._station.arm.stop()

        return call


RECOVERY_STEPS = 7  # clear, pose, up, clear, state of the hand, open, home


@pytest.mark.parametrize("late", [False, True])
@pytest.mark.parametrize("step", range(1, RECOVERY_STEPS + 1))
def test_a_stop_at_any_step_of_the_recovery_stands(
    station: Station, T_grasp: np.ndarray, step: int, late: bool
) -> None:
    countdown = [step]
    arm, gripper = (Pressing(d, station, countdown, late) for d in (station.arm, station.gripper))
    if late and step == RECOVERY_STEPS:
        recover(arm, gripper)  # type: ignore[arg-type]
    else:
        with pytest.raises(StoppedError):
            recover(arm, gripper)  # type: ignore[arg-type]
    assert countdown[0] <= 0
    assert_nothing_moves(station)


def test_the_recovery_has_as_many_steps_as_are_tried(station: Station, T_grasp: np.ndarray) -> None:
    countdown = [100]
    recover(*(Pressing(d, station, countdown, False) for d in (station.arm, station.gripper)))  # type: ignore[arg-type]
    assert 100 - countdown[0] == RECOVERY_STEPS


@pytest.mark.parametrize("target", ["grasp", "put down"])
def test_a_touch_that_meets_a_stop_does_not_clear_it(
    station: Station, T_grasp: np.ndarray, target: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A contact ends the motion, and before its error is cleared the operator presses stop."""
    move = station.arm.move_to_pose
    guarded = {"grasp": 1, "put down": 2}[target]
    seen = 0

    def touch(T: np.ndarray, **options: object) -> object:
        nonlocal seen
        done = move(T, **options)  # type: ignore[arg-type]
        seen += bool(options.get("guarded"))
        if options.get("guarded") and seen == guarded:
            station.arm.stop()
            raise CollisionStopError("touched")
        return done

    monkeypatch.setattr(station.arm, "move_to_pose", touch)
    with pytest.raises(StoppedError):
        execute_grasp(station.arm, station.gripper, T_grasp, station.clock)
    monkeypatch.undo()
    assert_nothing_moves(station)
