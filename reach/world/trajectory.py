"""Close, lift, hold: the hand's commands over time."""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np

from reach.arrays import FloatArray, positive


@dataclass(frozen=True, slots=True)
class LiftSchedule:
    """Times and distances of a simulated trial.

    Args:
        close_time: for the jaws to close and the part to come to rest [s].
        lift_height: [m].
        lift_time: [s].
        hold_time: at the top, at most; shorter once the outcome is decided [s].
    """

    close_time: float = 0.4
    lift_height: float = 0.1
    lift_time: float = 0.3
    hold_time: float = 1.0

    def __post_init__(self) -> None:
        for name in (each.name for each in fields(self)):
            positive(getattr(self, name), name)

    @property
    def end(self) -> float:
        """When the hold is over [s]."""
        return self.close_time + self.lift_time + self.hold_time

    def rise(self, times: FloatArray) -> FloatArray:
        """Commanded height above the grasp at some times [m]; starts and ends at rest."""
        share = np.clip((times - self.close_time) / self.lift_time, 0.0, 1.0)
        risen: FloatArray = self.lift_height * share * share * (3.0 - 2.0 * share)
        return risen
