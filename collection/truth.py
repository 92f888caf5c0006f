"""What only a simulation can tell: the true outcome, and how far registration was off.

Nothing here reaches a trial: it is called after the fact, for the simulated operator's label and
for statistics, and every name says that it is the truth.
"""

from __future__ import annotations

from collection.cell.operator import CLEARANCE, SimulatedVerdict
from logs.journal.events import FailureReason, Outcome, TrueOutcome
from reach.arrays import FloatArray
from reach.objects import GraspObject
from reach.symmetry import pose_distance, symmetry

NEVER_ROSE = 3e-3
"""An object that never rose by more was not lifted at all [m]."""


def registration_error(
    obj: GraspObject, T_world_object_true: FloatArray, T_world_object: FloatArray
) -> dict[str, float]:
    """True error of a registered pose up to the object's symmetry, by name ([rad] and [m])."""
    rotation, translation = pose_distance(symmetry(obj), T_world_object_true, T_world_object)
    return {
        "true_registration_error_rotation": rotation,
        "true_registration_error_translation": translation,
    }


def true_outcome(seen: SimulatedVerdict) -> TrueOutcome:
    """What an operator who sees everything would say, by the one rule of success."""
    if seen.lifted:
        return TrueOutcome(outcome=Outcome.SUCCESS, rotated=seen.rotated)
    if seen.highest < NEVER_ROSE:
        reason = FailureReason.MISSED
    elif seen.highest < CLEARANCE:
        reason = FailureReason.SLIPPED_ON_LIFT
    else:
        reason = FailureReason.DROPPED_WHILE_HELD
    return TrueOutcome(outcome=Outcome.FAILURE, reason=reason)
