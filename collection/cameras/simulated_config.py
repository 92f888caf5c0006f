"""The simulated depth camera's section of the station file."""

from __future__ import annotations

from typing import Literal

from pydantic import BaseModel, ConfigDict, Field

Vector = tuple[float, float, float]


class SimulatedCameraConfig(BaseModel):
    """Which kind of sensor, where it stands and how well it is calibrated.

    Attributes:
        driver: `simulated`.
        sensor: `structured-light` (fine, shadowed by the projector) or `stereo` (coarse, with
            correlated noise, holes and flying pixels).
        width: of the image [pixel]; by default the sensor's own.
        height: of the image [pixel].
        position: of the camera in the world [m].
        target: the point it looks at [m].
        calibration_offset: standard deviation of the calibrated position's error [m].
        calibration_tilt: standard deviation of the calibrated rotation's error [rad].
        timeout: how long a capture may take [s].
        video: whether to film the trial, where an off-screen renderer is found.
    """

    model_config = ConfigDict(extra="forbid", frozen=True)

    driver: Literal["simulated"]
    sensor: Literal["structured-light", "stereo"] = "structured-light"
    width: int | None = Field(default=None, ge=16, le=4096)
    height: int | None = Field(default=None, ge=16, le=4096)
    position: Vector = (0.80, -0.10, 0.55)
    target: Vector = (0.38, -0.10, 0.02)
    calibration_offset: float = Field(default=5e-4, ge=0)
    calibration_tilt: float = Field(default=1e-3, ge=0)
    timeout: float = Field(default=5.0, gt=0)
    video: bool = True
