"""The words on the console: the one rule of success, the failure reasons, and the keys."""

from __future__ import annotations

from typing import Final

from logs.journal.events import FailureReason, RedoCause

RULE: Final = (
    "Success: the object is clear of the table by 50 mm and still held after 1 s."
    " Turning in the grasp is a success, marked “rotated”."
)

REASON_TEXT: Final[dict[FailureReason, str]] = {
    FailureReason.MISSED: "missed",
    FailureReason.SLIPPED_ON_LIFT: "slipped on lift",
    FailureReason.DROPPED_WHILE_HELD: "dropped while held",
    FailureReason.TIPPED_BEFORE_CONTACT: "object tipped before contact",
    FailureReason.COLLISION: "collision",
    FailureReason.OTHER: "other",
}

CAUSE_TEXT: Final[dict[RedoCause, str]] = {
    RedoCause.PLACEMENT: "placement: the object was put down wrongly",
    RedoCause.SEEING: "seeing: the pose was found wrongly, or the outcome was not seen",
    RedoCause.MOVING: "moving: the robot did not do what was planned",
}

KEYS: Final[dict[str, str]] = {
    "placed": "Enter",
    "success": "s",
    "rotated": "t",
    "failure": "f",
    "undo": "u",
    "redo": "r",
    "skip": "k",
    "pause": "p",
    "note": "n",
    "stop": "Escape",
}
"""Default key per action, far apart for the two that matter; the page lets them be remapped."""
