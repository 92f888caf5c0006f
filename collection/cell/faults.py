"""Faults that happen on schedule in the simulated cell."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from enum import StrEnum

from collection.errors import CameraTimeoutError, CollisionStopError, ConnectionLostError


class FaultKind(StrEnum):
    """What can be made to go wrong.

    SLIP: the pads lose their friction when the arm lifts. CONNECTION_LOST and EMERGENCY_STOP:
    in the middle of the lift. COLLISION_STOP: in the middle of the slow approach.
    GRIPPER_NOT_CALIBRATED: at the first command to the hand. CAMERA_TIMEOUT: at the capture.
    """

    SLIP = "slip"
    CONNECTION_LOST = "connection_lost"
    COLLISION_STOP = "collision_stop"
    GRIPPER_NOT_CALIBRATED = "gripper_not_calibrated"
    EMERGENCY_STOP = "emergency_stop"
    CAMERA_TIMEOUT = "camera_timeout"


@dataclass(frozen=True, slots=True)
class Fault:
    """One fault: its kind, and the attempt it happens in, counted from 1 by placements."""

    kind: FaultKind
    attempt: int


class FaultSchedule:
    """The faults still to come; each happens once."""

    def __init__(self, faults: Iterable[Fault] = ()) -> None:
        self._waiting = list(faults)

    def add(self, fault: Fault) -> None:
        """Schedule one more."""
        self._waiting.append(fault)

    def due(self, kind: FaultKind, attempt: int) -> bool:
        """Whether a fault of this kind happens now; it is then spent."""
        for fault in self._waiting:
            if fault.kind is kind and fault.attempt == attempt:
                self._waiting.remove(fault)
                return True
        return False


def scripted(kind: FaultKind) -> Exception:
    """The error a driver raises for a scripted fault."""
    if kind is FaultKind.CONNECTION_LOST:
        return ConnectionLostError("the controller stopped answering during the lift (scripted)")
    if kind is FaultKind.COLLISION_STOP:
        return CollisionStopError("the arm met resistance during the approach (scripted)")
    return CameraTimeoutError("no image arrived (scripted)")
