"""From a verdict to a chance: how firmly a settled part is held."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from reach.arrays import FloatArray
from reach.models.settled import Settled
from reach.scene import Scene


@dataclass(frozen=True, slots=True)
class Grade:
    """Chance of success of a settled sample."""

    version: str = "share"

    def chances(self, scene: Scene, told: Settled) -> FloatArray:
        """Chance of each sample, shape (N,)."""
        return np.asarray(told.margin >= 1.0, dtype=float)


GRADE = Grade()
