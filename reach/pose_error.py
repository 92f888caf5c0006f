"""How far the object may be from where the station believes it is."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from reach.arrays import FloatArray, frozen_finite, positive
from reach.errors import InvalidInputError
from reach.transforms import exp

ANY_TURN = 1.0
"""A turn with a larger standard deviation than this may be any: about an axis of symmetry [rad]."""


@dataclass(frozen=True, slots=True, eq=False)
class PoseError:
    """A zero-mean normal distribution of the error of a pose.

    The error xi, ordered (rotation [rad], translation [m]), acts on the right: the true pose is
    `T @ exp(xi)`, so that the covariance is expressed in the object's frame.

    Args:
        covariance: symmetric, positive semi-definite, shape (6, 6).

    Raises:
        InvalidInputError: not finite, not symmetric, or with a negative variance.
    """

    covariance: FloatArray

    def __post_init__(self) -> None:
        covariance = frozen_finite(self.covariance, "pose covariance", (6, 6))
        scale = max(float(np.abs(covariance).max()), 1e-300)
        if np.abs(covariance - covariance.T).max() > 1e-9 * scale:
            raise InvalidInputError(f"pose covariance is not symmetric: {covariance.tolist()}")
        least = float(np.linalg.eigvalsh(covariance)[0])
        if least < -1e-9 * scale:
            raise InvalidInputError(f"pose covariance has the negative eigenvalue {least:.3g}")
        object.__setattr__(self, "covariance", covariance)

    @classmethod
    def isotropic(cls, *, translation: float, rotation: float) -> PoseError:
        """Equal in all directions: standard deviations of each coordinate [m] and angle [rad]."""
        t = positive(translation, "translation error [m]", zero_allowed=True)
        r = positive(rotation, "rotation error [rad]", zero_allowed=True)
        return cls(np.diag([r * r] * 3 + [t * t] * 3))

    def __add__(self, other: PoseError) -> PoseError:
        """Return the error of two independent causes together."""
        return PoseError(self.covariance + other.covariance)

    def without_free_turns(self) -> PoseError:
        """Return the error without turns that nothing tells, as of a round part about its axis.

        Registration states such a turn's variance as that of a full turn. No contact model can
        tell it either, and a sum or a mean over parts would be about nothing else.
        """
        variances, directions = np.linalg.eigh(self.covariance)
        known = np.where(variances < ANY_TURN**2, variances, 0.0)
        covariance = (directions * known) @ directions.T
        return PoseError(0.5 * (covariance + covariance.T))

    def __eq__(self, other: object) -> bool:
        return isinstance(other, PoseError) and np.array_equal(self.covariance, other.covariance)

    def __hash__(self) -> int:
        return hash(self.covariance.tobytes())

    def sample(self, rng: np.random.Generator, count: int) -> FloatArray:
        """Draw errors xi, shape (count, 6)."""
        return self.from_standard(rng.standard_normal((count, 6)))

    def from_standard(self, normal: FloatArray) -> FloatArray:
        """Turn independent standard normal numbers (N, 6) into errors xi (N, 6)."""
        variances, axes = np.linalg.eigh(self.covariance)
        root = axes * np.sqrt(np.maximum(variances, 0.0))
        errors: FloatArray = normal @ root.T
        return errors

    def perturb(self, T: FloatArray, rng: np.random.Generator, count: int) -> FloatArray:
        """Draw true poses `T @ exp(xi)` around an estimated one, shape (count, 4, 4)."""
        drawn: FloatArray = T @ exp(self.sample(rng, count))
        return drawn

    @property
    def translation_deviation(self) -> float:
        """Root mean square error of one coordinate [m]."""
        return float(np.sqrt(np.trace(self.covariance[3:, 3:]) / 3.0))

    @property
    def rotation_deviation(self) -> float:
        """Root mean square error of one angle [rad]."""
        return float(np.sqrt(np.trace(self.covariance[:3, :3]) / 3.0))
