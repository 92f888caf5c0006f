"""What the computer and the RAPID program `reach_trials.mod` say to each other.

The numbers and the order of the fields are those of the module; a test holds them together.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from enum import IntEnum

from collection.errors import (
    CollisionStopError,
    GripperNotCalibratedError,
    JointLimitError,
    RobotError,
    StoppedError,
    UnreachableError,
)
from collection.robots.yumi.rapid_text import ABSENT_AXIS, from_rapid, to_rapid

LAST_SEQUENCE = 8_000_000
"""RAPID's numbers have single precision: integers are exact up to 8,388,608."""


class Command(IntEnum):
    """What a request may ask for."""

    PING = 1
    MOVE_JOINTS = 2
    MOVE_POSE_JOINT = 3
    MOVE_POSE_LINEAR = 4
    JAW_OPEN = 5
    JAW_TO = 6
    JAW_GRIP = 7
    JAW_CALIBRATE = 8


class Failure(IntEnum):
    """What a reply may report."""

    OK = 0
    UNREACHABLE = 1
    JOINT_LIMIT = 2
    COLLISION = 3
    HAND_NOT_CALIBRATED = 4
    HAND_FAULT = 5
    UNKNOWN_COMMAND = 6
    RESTARTED = 7
    OTHER_FAULT = 8


@dataclass(frozen=True, slots=True)
class Request:
    """One request, in the controller's units.

    Args:
        command: what to do.
        joints_deg: of axes 1 to 6 and 7 last [deg]; of a pose, the branch to reach it on.
        position_mm: goal of tool0 in the robot's base frame, (x, y, z) [mm].
        quat_wxyz: its orientation.
        speed_mm: of tool0, or of a jaw [mm/s].
        turn_deg: of tool0 [deg/s].
        zone_mm: radius of the fly-by zone; 0 stops at the goal [mm].
        supervision_percent: how strong a resistance stops the arm, against the normal.
        jaw_mm: position of one jaw, 0 closed [mm].
        force: of the grip [N].
    """

    command: Command
    joints_deg: Sequence[float] = (0.0,) * 7
    position_mm: Sequence[float] = (0.0, 0.0, 0.0)
    quat_wxyz: Sequence[float] = (1.0, 0.0, 0.0, 0.0)
    speed_mm: float = 20.0
    turn_deg: float = 30.0
    zone_mm: float = 0.0
    supervision_percent: float = 100.0
    jaw_mm: float = 0.0
    force: float = 0.0

    def to_rapid(self, sequence: int) -> str:
        """As the value of `reach_request`; the last field repeats the first."""
        *robax, joint_7 = self.joints_deg
        return to_rapid(
            [
                sequence,
                int(self.command),
                [robax, [joint_7, *[ABSENT_AXIS] * 5]],
                [list(self.position_mm), list(self.quat_wxyz)],
                self.speed_mm,
                self.turn_deg,
                self.zone_mm,
                self.supervision_percent,
                self.jaw_mm,
                self.force,
                sequence,
            ]
        )


@dataclass(frozen=True, slots=True)
class Reply:
    """The program's answer.

    Args:
        sequence: of the request it answers.
        busy: whether that request is being served.
        done: whether it has been served, successfully or not.
        failure: why not.
        jaw_mm: position of one jaw at the end [mm]; negative if the hand could not be read.
        calibrated: whether the hand knows its jaws' position.
    """

    sequence: int
    busy: bool
    done: bool
    failure: Failure
    jaw_mm: float
    calibrated: bool

    @classmethod
    def from_rapid(cls, text: str) -> Reply:
        """Read the value of `reach_reply`.

        Raises:
            RobotError: it has another shape, so another module is loaded.
        """
        match from_rapid(text):
            case [float(seq), bool(busy), bool(done), float(error), float(jaw), bool(calibrated)]:
                return cls(int(seq), busy, done, _failure(int(error)), jaw, calibrated)
        raise RobotError(f"the controller's reach_reply is {text!r}: load this version's module")


_ERRORS: dict[Failure, tuple[type[RobotError], str]] = {
    Failure.UNREACHABLE: (UnreachableError, "the controller finds the pose outside its reach"),
    Failure.JOINT_LIMIT: (UnreachableError, "the controller reaches the pose beyond a joint limit"),
    Failure.COLLISION: (CollisionStopError, "the arm met resistance, stopped and lifted off"),
    Failure.HAND_NOT_CALIBRATED: (GripperNotCalibratedError, "the hand is not calibrated"),
    Failure.HAND_FAULT: (RobotError, "the hand is in a wrong state or missed its position"),
    Failure.UNKNOWN_COMMAND: (RobotError, "the module does not know this command: another version"),
    Failure.RESTARTED: (StoppedError, "the program was restarted before it served the request"),
    Failure.OTHER_FAULT: (RobotError, "an error without a name; see the controller's event log"),
}


def _failure(number: int) -> Failure:
    try:
        return Failure(number)
    except ValueError:
        return Failure.OTHER_FAULT


def readable_jaw(jaw_mm: float) -> float:
    """A jaw's position as the program reports it [mm].

    Raises:
        RobotError: it reports that the hand cannot be read.
    """
    if jaw_mm < 0:
        raise RobotError("the hand's position cannot be read: is the hand powered?")
    return jaw_mm


def raise_failure(request: Request, failure: Failure) -> None:
    """Raise what a reply reports, as a typed error; nothing if the request succeeded.

    Raises:
        RobotError: or one of its kinds, by what failed.
    """
    if failure is Failure.OK:
        return
    kind, reason = _ERRORS[failure]
    if failure is Failure.JOINT_LIMIT and request.command is Command.MOVE_JOINTS:
        kind = JointLimitError
    raise kind(f"{request.command.name.lower()}: {reason}")


def next_sequence(sequence: int) -> int:
    """The number after this one; 0 is never used, it stands for no request."""
    return sequence % LAST_SEQUENCE + 1
