"""The words of a session: where a take stands, what became of it, and who says so."""

from __future__ import annotations

from enum import StrEnum


class Phase(StrEnum):
    """Where a take of a trial stands."""

    PLACE_OBJECT = "PLACE_OBJECT"
    CAPTURE = "CAPTURE"
    REGISTER = "REGISTER"
    CONFIRM_POSE = "CONFIRM_POSE"
    EXECUTE = "EXECUTE"
    AWAITING_LABEL = "AWAITING_LABEL"
    RESET = "RESET"


class Outcome(StrEnum):
    """The operator's answer to the one question: was the object stably lifted?"""

    SUCCESS = "success"
    FAILURE = "failure"


class FailureReason(StrEnum):
    """Why a grasp failed, as the operator saw it."""

    MISSED = "missed"
    SLIPPED_ON_LIFT = "slipped_on_lift"
    DROPPED_WHILE_HELD = "dropped_while_held"
    TIPPED_BEFORE_CONTACT = "tipped_before_contact"
    COLLISION = "collision"
    OTHER = "other"


class RedoCause(StrEnum):
    """Why a take does not count: what went wrong before the jaws closed."""

    PLACEMENT = "placement"
    SEEING = "seeing"
    MOVING = "moving"


class Source(StrEnum):
    """Who decided: a person, or the simulated operator that looks at the simulation's truth."""

    OPERATOR = "operator"
    OPERATOR_SIM = "operator_sim"
