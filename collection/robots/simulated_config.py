"""The simulated robot's section of the station file."""

from __future__ import annotations

from typing import Literal

from pydantic import BaseModel, ConfigDict


class SimulatedRobotConfig(BaseModel):
    """Which arm, and where it stands.

    Attributes:
        driver: `simulated`.
        side: which of the two arms works.
        base: x, y, z of the robot's base in the world [m].
    """

    model_config = ConfigDict(extra="forbid", frozen=True)

    driver: Literal["simulated"]
    side: Literal["right", "left"] = "right"
    base: tuple[float, float, float] = (0.0, 0.0, 0.0)
