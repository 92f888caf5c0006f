"""What a test makes go wrong."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass
class Faults:
    """Each is off by default and may be set at any time.

    Args:
        collide_at: the next motion meets an obstacle at this share of its way; used up by it.
        collisions: how many motions in a row meet it.
        collision_handled: whether this controller raises ERR_COLL_STOP in the program (its system
            parameter); otherwise the program stops with event 50204.
        hand_faults: how many coming hand commands fail because the hand is in a wrong state.
        hand_unpowered: the hand cannot be read.
        calibration_fails: the hand does not keep its calibration.
        freeze_joint_7: jointtarget keeps reporting the joint 7 of this moment.
        feedback_lag: all of jointtarget and robtarget lag by this much time [s].
        drop_before: so many coming requests to the program are cut before they are carried out.
        drop_after: so many are carried out, but their answers are cut.
        deaf: so many coming connections are closed at once, whatever they ask.
        task_delay: time the program takes to notice a request [s].
        hang: the program no longer runs although the controller says so.
    """

    collide_at: float | None = None
    collisions: int = 1
    collision_handled: bool = True
    hand_faults: int = 0
    hand_unpowered: bool = False
    calibration_fails: bool = False
    freeze_joint_7: bool = False
    feedback_lag: float = 0.0
    drop_before: int = 0
    drop_after: int = 0
    deaf: int = 0
    task_delay: float = 0.0
    hang: bool = False
