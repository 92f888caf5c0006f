"""What registration assumes of a sensor, and when it accepts a pose."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from registration.frame import DepthFrame


@dataclass(frozen=True, slots=True)
class SensorProfile:
    """Noise scales and acceptance thresholds of one kind of depth sensor.

    The noise itself is measured on the table in every image; the profile bounds it.

    Args:
        noise_bounds: smallest and largest believable standard deviation of a depth [m].
        cut: nothing lower above the table than this is taken for the object [m].
        distinct: poses whose surfaces part by more than this are physically different [m].
        max_cost: a pose with a larger render cost does not explain the image.
        min_margin: less evidence than this against some rival makes a pose ambiguous; see
            `registration.evidence.Evidence`.
        bias: standard deviation of the error that a whole patch of depths shares, as far as the
            comparison of poses allows for it [m].
    """

    noise_bounds: tuple[float, float]
    cut: float
    distinct: float
    max_cost: float
    min_margin: float
    bias: float


PROFILES = {
    "structured-light": SensorProfile((1e-4, 6e-4), 0.8e-3, 3e-3, 0.25, 0.05, 1e-5),
    "stereo": SensorProfile((4e-4, 3e-3), 3e-3, 5e-3, 0.35, 0.05, 1e-4),
}
"""By `DepthFrame.sensor`."""


@dataclass(frozen=True, slots=True)
class RegistrationOptions:
    """Choices of a registration.

    Args:
        profile: of the sensor; by the frame's kind of sensor if None.
        max_table_tilt: largest angle between the table's normal and the world's z [rad].
        max_tilt: a part that stands further than this from every stable pose is refused [rad].
        max_turn_error: a pose that may be turned by more than this, up to the part's symmetry,
            is ambiguous [rad].
        max_shift_error: the same for the center of mass [m].
        min_points: fewest depth points of a part.
        check_other_poses: with a declared stable pose, also search the others and notice when
            one of them explains the image better.
    """

    profile: SensorProfile | None = None
    max_table_tilt: float = float(np.radians(15))
    max_tilt: float = float(np.radians(8))
    max_turn_error: float = float(np.radians(5))
    max_shift_error: float = 2e-3
    min_points: int = 60
    check_other_poses: bool = True

    def profile_for(self, frame: DepthFrame) -> SensorProfile:
        """The chosen profile, else that of the frame's kind of sensor."""
        return self.profile if self.profile is not None else PROFILES[frame.sensor]
