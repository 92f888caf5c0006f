"""What can go wrong at the station, as types that say what to do next."""

from __future__ import annotations

from enum import StrEnum
from typing import ClassVar

from reach.errors import InvalidInputError, ReachError


class Recovery(StrEnum):
    """What a session does after a device failed during a trial.

    RETRY re-initializes the device and runs the same trial again, once; VOID gives the attempt
    up and places the object again; HALT waits for a person, because no command can help.
    """

    RETRY = "retry"
    VOID = "void"
    HALT = "halt"


class CollectionError(ReachError):
    """Base of the station's errors."""


class StationFileError(CollectionError, InvalidInputError):
    """A station file that cannot be read: unknown driver or key, wrong type, broken TOML."""


class MissingExtraError(CollectionError):
    """A driver whose library is an extra that is not installed."""

    def __init__(self, what: str, extra: str) -> None:
        super().__init__(f"{what} needs the extra [{extra}]: pip install 'reach-trials[{extra}]'")


class DeviceError(CollectionError):
    """A device did not do what it was told; never a failed grasp."""

    recovery: ClassVar[Recovery] = Recovery.VOID


class RobotError(DeviceError):
    """Base of the errors of arm and gripper."""


class UnreachableError(RobotError):
    """No arm configuration within the joint limits reaches the pose."""


class JointLimitError(RobotError):
    """A commanded joint position lies outside its limits."""


class UnsafeMotionError(RobotError):
    """The dry run found that a planned motion would touch the table or the robot itself."""


class CollisionStopError(RobotError):
    """The arm met resistance where its path should be free, and stopped."""


class GripperNotCalibratedError(RobotError):
    """The hand does not know its jaws' position; calibrating it mends that."""

    recovery = Recovery.RETRY


class NotInAutoError(RobotError):
    """The controller is not in automatic mode."""

    recovery = Recovery.HALT


class ControllerTakenError(RobotError):
    """Another process of this computer leads the arm."""

    recovery = Recovery.HALT


class MotorsOffError(RobotError):
    """The motors are off."""

    recovery = Recovery.HALT


class EmergencyStopError(RobotError):
    """The emergency stop is pressed."""

    recovery = Recovery.HALT


class ConnectionLostError(RobotError):
    """The controller no longer answers."""

    recovery = Recovery.RETRY


class RobotTimeoutError(RobotError):
    """A command was not done within its time."""

    recovery = Recovery.RETRY


class StaleReadingError(RobotError):
    """The controller reported values older than the command they should follow."""

    recovery = Recovery.RETRY


class NotConnectedError(RobotError):
    """A command before connect() or after disconnect()."""

    recovery = Recovery.RETRY


class StoppedError(RobotError):
    """Someone stopped the motion; it goes on when a person says so."""

    recovery = Recovery.HALT


class CameraError(DeviceError):
    """Base of the cameras' errors."""


class CameraTimeoutError(CameraError):
    """No image arrived within the time allowed."""

    recovery = Recovery.RETRY


class CameraNotConnectedError(CameraError):
    """A capture before connect() or after disconnect()."""

    recovery = Recovery.RETRY


class CalibrationError(CollectionError, InvalidInputError):
    """Images or poses that do not make a hand-eye calibration, or a file that does not hold one."""


class PlanError(CollectionError):
    """Base of what keeps a plan from being made."""


class DuplicateNameError(PlanError):
    """Two parts of one plan share a name."""


class NoGraspError(PlanError):
    """A part that the gripper cannot hold in any way it can lie."""


class PlacementError(CollectionError):
    """The object lies otherwise than planned, or out of reach: it is put down again."""


class OptionsError(CollectionError, InvalidInputError):
    """An option of a session that is missing, impossible, or contradicts the session's own."""
