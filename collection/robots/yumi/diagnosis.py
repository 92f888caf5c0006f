"""Why the controller does not do what it should: its state and event log as typed errors."""

from __future__ import annotations

from collection.errors import (
    CollisionStopError,
    EmergencyStopError,
    JointLimitError,
    MotorsOffError,
    NotInAutoError,
    RobotError,
    StoppedError,
    UnreachableError,
)
from collection.robots.yumi.web_services import ControllerState, Event, WebServices

ERROR_KIND = 3
"""Of an event: 1 information, 2 warning, 3 error."""

# Event numbers of the IRC5 ("Operating manual, Trouble shooting", 3HAC020738).
_EVENTS: dict[int, type[RobotError]] = {
    50027: JointLimitError,  # joint out of range
    50050: UnreachableError,  # position outside reach
    50204: CollisionStopError,  # motion supervision
}


def not_ready(state: ControllerState) -> RobotError | None:
    """The error that keeps the arm from following commands; None if it would follow."""
    if state.motors.startswith("emergencystop"):
        return EmergencyStopError(
            "the emergency stop is active: release it, then acknowledge it on the pendant"
        )
    if state.mode != "AUTO":
        return NotInAutoError(
            f"the controller is in mode {state.mode}: turn the key to automatic and confirm"
        )
    if state.motors != "motoron":
        return MotorsOffError(f"the motors are off ({state.motors}): switch them on")
    return None


def newest_event(services: WebServices) -> int:
    """Number of the newest message in the event log; 0 if it cannot be read."""
    return max((event.number for event in _events(services)), default=0)


def stop_reason(services: WebServices, since: int) -> RobotError:
    """Why the programs do not run, as an error to raise.

    Args:
        services: session with the controller.
        since: number of the last event that is older than the stop.
    """
    reason = not_ready(services.state())
    if reason is not None:
        return reason
    errors = [e for e in _events(services) if e.number > since and e.kind == ERROR_KIND]
    for event in errors:
        if event.code in _EVENTS:
            return _EVENTS[event.code](f"the controller stopped: {_said(event)}")
    if errors:
        return RobotError(f"the controller stopped: {_said(errors[0])}")
    return StoppedError("the controller's program was stopped")


def _said(event: Event) -> str:
    return f"{event.title} (event {event.code})"


def _events(services: WebServices) -> list[Event]:
    try:
        return services.events()
    except RobotError:
        return []  # a log that cannot be read must not hide that the arm has stopped
