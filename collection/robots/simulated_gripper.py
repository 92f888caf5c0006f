"""The simulated hand: its jaws are driven by force against simulated physics."""

from __future__ import annotations

from typing import Self

from collection.cell.faults import FaultKind
from collection.errors import GripperNotCalibratedError, RobotTimeoutError, StoppedError
from collection.robots.readings import GripperListener, GripperMotion, GripperSample, GripperState
from collection.robots.simulated_controller import SimulatedController
from reach.arrays import positive
from reach.errors import InvalidInputError
from reach.gripper import ParallelJawGripper

PERIOD = 0.02
"""Between two looks at the jaws [s]."""
RESTING_SPEED = 2e-4
RESTING_LOOKS = 4
TIMEOUT = 6.0
PRESSING_TIME = 2.0
"""A hand which has pressed for so long has gripped, though the part still creeps [s]."""
PRESSING_SHARE = 0.25
"""Of the force asked for: the jaws press, on a part or on each other."""
WIDTH_TOLERANCE = 2e-4
HOLDING_FORCE = 1.0
"""Stopped jaws that press with more hold something, and go on [N]."""


class SimulatedGripper:
    """A simulated SmartGripper.

    Args:
        controller: shared with the arm.
        calibration_force: its width is zero where the empty jaws rest under this force [N]; by the
            force they grip with, what they hold shows, however thin.
    """

    def __init__(self, controller: SimulatedController, calibration_force: float) -> None:
        self._controller = controller
        self._calibration_force = calibration_force
        self._simulation = controller.simulation
        self._calibrated = True

    @property
    def name(self) -> str:
        """Of the hand, for logs."""
        return "simulated SmartGripper"

    @property
    def geometry(self) -> ParallelJawGripper:
        """Pads, stroke, force and solids."""
        return self._simulation.gripper

    def connect(self) -> None:
        """Reach the simulated hand."""
        self._controller.connect("gripper")

    def disconnect(self) -> None:
        """Let go of the hand."""
        self._controller.disconnect("gripper")

    def __enter__(self) -> Self:
        self.connect()
        return self

    def __exit__(self, *exception: object) -> None:
        self.disconnect()

    def state(self) -> GripperState:
        """What the hand says of itself."""
        return GripperState(self._controller.connected("gripper"), self._calibrated)

    def calibrate(self) -> GripperMotion:
        """Find the jaws' zero: close and open once."""
        self._controller.require("gripper")
        start_ns = self._simulation.clock.now_ns()
        self._calibrated = True
        self.close(self._calibration_force)
        done = self.open()
        return GripperMotion(start_ns, done.end_ns, done.width, done.force)

    def open(
        self, width: float | None = None, *, on_sample: GripperListener | None = None
    ) -> GripperMotion:
        """Open to a width [m]; fully if None.

        Raises:
            GripperNotCalibratedError: the hand does not know where its jaws are.
            InvalidInputError: a width outside the stroke.
        """
        target = self.geometry.max_opening if width is None else float(width)
        if not 0.0 <= target <= self.geometry.max_opening:
            raise InvalidInputError(
                f"width {width!r} m is outside 0 to {self.geometry.max_opening} m"
            )
        start_ns = self._begin()
        closing = self._width() > target + WIDTH_TOLERANCE
        force = self.geometry.max_force
        self._simulation.drive_jaws(force if closing else -force)
        self._wait(lambda: self._past(target, closing=closing), on_sample)
        self._simulation.drive_jaws(0.0)
        return self._done(start_ns)

    def close(self, force: float, *, on_sample: GripperListener | None = None) -> GripperMotion:
        """Close with a force [N] until the jaws rest, or have pressed for two seconds.

        A part that is slowly squeezed out never lets the jaws rest. That is an outcome of the
        grasp, not a fault of the hand, so the trial goes on.

        Raises:
            GripperNotCalibratedError: the hand does not know where its jaws are.
            InvalidInputError: a force outside the hand's range.
            RobotTimeoutError: the jaws move on without pressing on anything.
        """
        if positive(force, "closing force [N]") > self.geometry.max_force:
            raise InvalidInputError(
                f"closing force {force} N is above the hand's {self.geometry.max_force} N"
            )
        start_ns = self._begin()
        self._simulation.drive_jaws(force)
        looks = _Grip(PRESSING_SHARE * force)
        simulation = self._simulation
        self._wait(lambda: looks.done(simulation.jaw_speed, simulation.grip_force), on_sample)
        return self._done(start_ns)

    def read(self) -> GripperSample:
        """Read width and force."""
        self._controller.require("gripper")
        return self._sample()

    def stop(self) -> None:
        """Keep the jaws as they are, until the arm's `release_stop`: a held part stays held."""
        self._controller.stop()

    def halt(self) -> None:
        """Keep the jaws as they are, until the arm's `clear_error`."""
        self._controller.halt()

    def _begin(self) -> int:
        self._controller.require("gripper")
        if self._simulation.fault_due(FaultKind.GRIPPER_NOT_CALIBRATED):
            self._calibrated = False
        if not self._calibrated:
            raise GripperNotCalibratedError("the hand is not calibrated: call calibrate()")
        start_ns = self._simulation.clock.now_ns()
        self._simulation.clock.sleep(self._simulation.settings.latency)
        return start_ns

    def _wait(self, done: object, on_sample: GripperListener | None) -> None:
        clock = self._simulation.clock
        limit_ns = clock.now_ns() + round(TIMEOUT * 1e9)
        while True:
            self._heed_stop()
            clock.sleep(PERIOD)
            if on_sample is not None:
                on_sample(self._sample())
            self._heed_stop()
            if done():  # type: ignore[operator]
                return
            if clock.now_ns() > limit_ns:
                raise RobotTimeoutError(f"the jaws did not come to rest within {TIMEOUT} s")

    def _heed_stop(self) -> None:
        """End a motion of the jaws that the operator stopped; jaws that hold go on holding."""
        try:
            self._controller.heed_stop()
        except StoppedError:
            simulation = self._simulation
            if not (simulation.carrying and simulation.grip_force > HOLDING_FORCE):
                simulation.drive_jaws(0.0)
            raise

    def _past(self, target: float, *, closing: bool) -> bool:
        width = self._width()
        return width <= target if closing else width >= target - WIDTH_TOLERANCE

    def _width(self) -> float:
        """Distance of the jaws from where they rest, closed on nothing [m]; not more than open."""
        simulation = self._simulation
        zero = simulation.empty_opening(self._calibration_force)
        return min(simulation.opening - zero, self.geometry.max_opening)

    def _done(self, start_ns: int) -> GripperMotion:
        sample = self._sample()
        return GripperMotion(start_ns, sample.time_ns, sample.width, sample.force)

    def _sample(self) -> GripperSample:
        simulation, settings = self._simulation, self._simulation.settings
        width = self._width() + simulation.noise.normal(0.0, settings.width_noise)
        force = simulation.grip_force + simulation.noise.normal(0.0, settings.force_noise)
        return GripperSample(
            simulation.clock.now_ns(), max(0.0, float(width)), max(0.0, float(force))
        )


class _Grip:
    """Looks at closing jaws: whether they rest, or press for long enough."""

    def __init__(self, pressing_force: float) -> None:
        self._pressing_force = pressing_force
        self._at_rest = 0
        self._pressing = 0

    def done(self, speed: float, force: float) -> bool:
        self._at_rest = self._at_rest + 1 if abs(speed) < RESTING_SPEED else 0
        self._pressing = self._pressing + 1 if force > self._pressing_force else 0
        return self._at_rest >= RESTING_LOOKS or self._pressing * PERIOD >= PRESSING_TIME
