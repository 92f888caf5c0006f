"""What the settled model answers: the verdict, and what the part did before it rested."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum

import numpy as np

from reach.arrays import FloatArray
from reach.contact import Reason, Verdict


class Fate(StrEnum):
    """How a grasp ends, in the order of the kernel's codes."""

    HELD = "held"
    NO_CONTACT = "no contact"
    SQUEEZED_OUT = "squeezed out"
    STILL_SLIDING = "still sliding"
    SLIPPED_ON_LIFT = "slipped on lift"
    JAMMED = "jammed"


FATES = tuple(Fate)
REASON_OF = (
    Reason.HOLDS,
    Reason.NO_CONTACT,
    Reason.SLIPS,
    Reason.SLIPS,
    Reason.SLIPS,
    Reason.HOLDS,
)
"""Reason of each fate."""
PUSHED = 1e-4
"""A push is told from here on [m]."""


@dataclass(frozen=True, slots=True, eq=False)
class Settlement:
    """How the part moved between the jaws.

    Attributes:
        fate: how it ended.
        translation: of the center of mass while the table carried the part [m], seen from the
            hand; a part off the middle is brought there.
        yaw: rotation about the table's normal in that time [rad].
        path: T_world_object at every step, as if the hand had not risen, shape (P, 4, 4).
        rest: index in `path` of the pose in which the lift began.
        preload_share: preload over the most that friction could oppose to it; 1 is the limit.
        area: of the lesser jaw's patch at the pad's deformable depth [m^2].
        inside: distance of the pressures' centers from the pads' outline, the lesser [m].
        lift_motion: of the part in the hand while it was lifted [m].
        pushed: the translation until the second jaw touched [m].
        residual: what friction could not balance in the end [N], torques over the torque scale.
    """

    fate: Fate
    translation: float
    yaw: float
    path: FloatArray
    rest: int
    preload_share: float
    area: float
    inside: float
    lift_motion: float
    pushed: float
    residual: float

    @property
    def T_world_object(self) -> FloatArray:
        """Pose of the settled part, before the lift, shape (4, 4)."""
        pose: FloatArray = self.path[self.rest]
        return pose

    def thinned(self, most: int = 12) -> FloatArray:
        """Poses of the path for a drawing: `details.path` of a score, and the view's ghosts.

        Each is a T_world_object, 4 rows of 4 numbers in meters, in the order in which the part
        takes them: first where it lay when the jaws began to close; last where it ended, as if the
        hand had not risen. The pose in which the lift begins is always one of them. A part that
        never moves has one.

        Args:
            most: number of poses, at least 3.

        Returns:
            Shape (K, 4, 4), 1 <= K <= most.
        """
        count = len(self.path)
        kept = np.linspace(0, count - 1, min(most - 1, count)).round().astype(int)
        chosen: FloatArray = self.path[np.unique(np.append(kept, self.rest))]
        return chosen


@dataclass(frozen=True, eq=False)
class SettledVerdict(Verdict):
    """A verdict that knows what happened before."""

    settlement: Settlement | None = None

    @property
    def explanation(self) -> str:
        """One sentence for a person."""
        if self.settlement is None or self.settlement.fate is Fate.NO_CONTACT:
            return super().explanation
        told = self.settlement
        way = f"{told.translation * 1e3:.1f} mm and {np.degrees(told.yaw):.1f} deg"
        if told.pushed > PUSHED:
            way += f" ({told.pushed * 1e3:.1f} mm by the jaw that touches first)"
        if told.fate is Fate.SQUEEZED_OUT:
            lost = " and ".join(map(str, self.missing_jaws))
            return f"squeezed out of the jaws after {way}: lost on jaw {lost}"
        if told.fate is Fate.STILL_SLIDING:
            return f"still sliding after {way}"
        stood = f"settles by {way}" if told.rest else "rests as it lay"
        if told.fate is Fate.SLIPPED_ON_LIFT:
            if self.missing_jaws:
                return f"{stood}, slips on the lift: lost after {told.lift_motion * 1e3:.1f} mm"
            return f"{stood}, still slips after {told.lift_motion * 1e3:.1f} mm of the lift"
        if told.fate is Fate.JAMMED:
            return (
                f"{stood}, hangs jammed: {told.residual:.2g} N more than friction can balance, "
                "but no motion would release energy"
            )
        return f"{stood}, holds {self.margin:.3g} times gravity"
