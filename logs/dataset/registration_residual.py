"""What a registered pose is off the plan, and what registrations claim to be off.

A part at rest on the table has its planned tilt and height, whatever the operator's hand did. The
other three directions (in the table's plane, and turning on it) are placed anew every time.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from logs.dataset.labeled_trial import LabeledTrial
from reach.arrays import FloatArray
from reach.pose_error import PoseError

SAME_SIDE = 0.9
"""Cosine of the tilt above which a part lies on its planned side."""


@dataclass(frozen=True, slots=True)
class RestingResidual:
    """The registered against the planned pose of a part at rest.

    Args:
        tilt_x: rotation about the world's x that takes the planned to the registered vertical [rad].
        tilt_y: the same about y.
        height: registered above planned [m].
    """

    tilt_x: float
    tilt_y: float
    height: float

    @property
    def tilt(self) -> float:
        """Angle between the two verticals [rad]."""
        return float(np.hypot(self.tilt_x, self.tilt_y))


def resting_residual(trial: LabeledTrial) -> RestingResidual | None:
    """Residual of a trial; None if nothing was registered, or the part on another side."""
    registered, planned = trial.execution.T_world_object, trial.T_world_object
    if registered is None:
        return None
    # The vertical in the object's frame, as planned and as registered: what turns one into the
    # other is the tilt, free of how the part was turned on the table.
    cosine = float(registered[2, :3] @ planned[2, :3])
    if cosine < SAME_SIDE:
        return None
    turn = planned[:3, :3] @ np.cross(planned[2, :3], registered[2, :3])
    sine = float(np.linalg.norm(turn))
    scale = np.arctan2(sine, cosine) / sine if sine > 0 else 1.0
    height = float(registered[2, 3] - planned[2, 3])
    return RestingResidual(float(turn[0] * scale), float(turn[1] * scale), height)


def claimed_variances(trials: Iterable[LabeledTrial]) -> tuple[FloatArray, int] | None:
    """Mean variances that registrations state of themselves, and of how many; None without any.

    Turns about an axis of symmetry are left out: no grasp can tell them either.

    Returns:
        Shape (6,), (rotation [rad^2], translation [m^2]), object frame.
    """
    covariances = [t.execution.covariance for t in trials if t.execution.covariance is not None]
    if not covariances:
        return None
    told = [PoseError(covariance).without_free_turns().covariance for covariance in covariances]
    return np.mean([np.diag(covariance) for covariance in told], axis=0), len(covariances)
