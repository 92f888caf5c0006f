"""The real SmartGripper, driven by the HandDriver routines of the RAPID program."""

from __future__ import annotations

from typing import Self

from collection.errors import GripperNotCalibratedError, RobotError
from collection.robots.readings import GripperListener, GripperMotion, GripperSample, GripperState
from collection.robots.yumi.link import PING_TIMEOUT, ControllerLink
from collection.robots.yumi.messages import Command, Request, readable_jaw
from reach.errors import InvalidInputError
from reach.gripper import ParallelJawGripper

HOLDER = "the SmartGripper"
JAW_TIMEOUT, CALIBRATION_TIMEOUT = 15.0, 30.0
"""The whole stroke takes 1.3 s at full speed [s]."""
CALIBRATION_SPEED_MM = 10.0


class SmartGripper:
    """The hand of one arm. Both jaws move alike; a width is the distance of the pads' faces.

    The hand measures the jaws' position, not the force: `force` is what the hand was told to
    hold, and 0 once the jaws were opened.

    Args:
        link: to the controller; the arm shares it.
        geometry: pads, stroke, force and solids.
        calibration_force: its zero is where the empty jaws rest under this force [N]. With the force
            of the grip, even a thin part shows in the width; soft pads give way by half a millimeter.
    """

    def __init__(
        self, link: ControllerLink, geometry: ParallelJawGripper, calibration_force: float
    ) -> None:
        self._link, self._geometry = link, geometry
        self._calibration_force = calibration_force
        self._force = 0.0

    @property
    def name(self) -> str:
        """Of the hand, for logs."""
        return f"ABB SmartGripper at {self._link.task}"

    @property
    def geometry(self) -> ParallelJawGripper:
        """Pads, stroke, force and solids; readable while disconnected."""
        return self._geometry

    def connect(self) -> None:
        """Reach the hand; moves nothing."""
        self._link.connect(HOLDER)

    def disconnect(self) -> None:
        """Let go of the hand; allowed at any time, more than once."""
        self._link.disconnect(HOLDER)

    def __enter__(self) -> Self:
        self.connect()
        return self

    def __exit__(self, *exception: object) -> None:
        self.disconnect()

    def state(self) -> GripperState:
        """What the hand says of itself."""
        if not self._link.held_by(HOLDER):
            return GripperState(connected=False, calibrated=False)
        try:
            reply = self._link.program.ping(PING_TIMEOUT)
        except RobotError as error:
            return GripperState(connected=False, calibrated=False, error=str(error))
        if reply.jaw_mm < 0:
            return GripperState(True, False, error="the jaws' position cannot be read")
        return GripperState(connected=True, calibrated=reply.calibrated)

    def calibrate(self) -> GripperMotion:
        """Find the jaws' zero by closing them; nothing may be between the jaws."""
        request = Request(
            Command.JAW_CALIBRATE, speed_mm=CALIBRATION_SPEED_MM, force=self._calibration_force
        )
        return self._move(request, force=0.0, timeout=CALIBRATION_TIMEOUT)

    def open(
        self, width: float | None = None, *, on_sample: GripperListener | None = None
    ) -> GripperMotion:
        """Open to a width [m]; fully if None. A hand that is not calibrated is calibrated first.

        Raises:
            GripperNotCalibratedError: the hand does not keep its calibration.
        """
        if width is None:
            request = Request(Command.JAW_OPEN, speed_mm=self._speed_mm)
        else:
            travel = self._geometry.travel(width)  # refuses a width outside the stroke
            jaw = self._geometry.stroke - travel
            request = Request(Command.JAW_TO, jaw_mm=1000 * jaw, speed_mm=self._speed_mm)
        try:
            return self._move(request, force=0.0, on_sample=on_sample)
        except GripperNotCalibratedError:
            self.calibrate()
            return self._move(request, force=0.0, on_sample=on_sample)

    def close(self, force: float, *, on_sample: GripperListener | None = None) -> GripperMotion:
        """Close with a force [N] until the jaws rest on something, or on each other.

        It does not calibrate: with an object between the jaws that would put the zero on the
        object. The retried trial opens first, and there the hand is calibrated.

        Raises:
            GripperNotCalibratedError: the hand does not know where its jaws are.
            InvalidInputError: the hand cannot exert this force.
        """
        if not 0.0 < force <= self._geometry.max_force:
            raise InvalidInputError(
                f"closing force {force!r} N is outside 0 to {self._geometry.max_force} N"
            )
        request = Request(Command.JAW_GRIP, force=force, speed_mm=self._speed_mm)
        return self._move(request, force=force, on_sample=on_sample)

    def read(self) -> GripperSample:
        """Read width and force; also from a listener while arm or hand moves."""
        return self._sample(self._link.require(HOLDER).jaw_mm())

    def stop(self) -> None:
        """Stop the jaws where they are, still holding, until the arm's `release_stop`."""
        self._link.stop()

    def halt(self) -> None:
        """Stop the jaws where they are, still holding; the arm halts, too."""
        self._link.halt()

    @property
    def _speed_mm(self) -> float:
        return 1000 * self._geometry.max_speed

    def _move(
        self,
        request: Request,
        *,
        force: float,
        timeout: float = JAW_TIMEOUT,
        on_sample: GripperListener | None = None,
    ) -> GripperMotion:
        program, clock = self._link.require(HOLDER), self._link.clock
        report = None if on_sample is None else lambda: on_sample(self.read())
        start_ns = clock.now_ns()
        reply = program.serve(request, timeout=timeout, meanwhile=report)
        self._force = force
        sample = self._sample(readable_jaw(reply.jaw_mm))
        if on_sample is not None:
            on_sample(sample)
        return GripperMotion(start_ns, sample.time_ns, sample.width, sample.force)

    def _sample(self, jaw_mm: float) -> GripperSample:
        return GripperSample(self._link.clock.now_ns(), 2 * jaw_mm / 1000, self._force)
