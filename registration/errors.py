"""Why a registration was refused: each voids the trial, none is a failed grasp."""

from __future__ import annotations

from reach.errors import ReachError


class RegistrationError(ReachError):
    """The image does not tell where the object is; the trial is voided and placed again."""


class NoTableError(RegistrationError):
    """No table plane was found in the depth image."""


class TooFewPointsError(RegistrationError):
    """Too few depth points lie above the table."""


class NoGoodPoseError(RegistrationError):
    """Even the best pose does not explain the image: wrong object, clutter, or a moved camera."""


class TiltedPoseError(RegistrationError):
    """The best pose is tilted against the table beyond tolerance."""


class PictureError(ReachError):
    """A picture of a registration cannot be drawn."""


class CloudFileError(ReachError):
    """A point cloud or its camera file cannot be read."""
