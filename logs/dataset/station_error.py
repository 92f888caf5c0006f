"""What a station states of itself that a data set needs: its own pose errors, its table's height."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from logs.dataset.dataset import StatedPoseError
from logs.dataset.labeled_trial import LabeledTrial
from logs.dataset.registration_residual import claimed_variances
from logs.session.folder import SessionFolder
from reach.arrays import FloatArray


@dataclass(frozen=True, slots=True)
class StationError:
    """Errors of calibration and actuation together.

    Drawn once, not anew in each trial: what a calibration is off, it is off all day.

    Args:
        translation: variance along each axis [m^2].
        rotation: variance about each axis [rad^2].
        whence: where the numbers are from.
    """

    translation: float
    rotation: float
    whence: str

    def beside(self, covariance: FloatArray) -> FloatArray:
        """The covariance (6, 6) of a registered pose, with these errors added."""
        return covariance + np.diag([self.rotation] * 3 + [self.translation] * 3)


def station_error(folder: SessionFolder) -> StationError | None:
    """The errors a session's station file states; None if it states none.

    Its section `pose_error` holds standard deviations named by cause: calibration, actuation.
    """
    numbers = _section(folder, "pose_error")
    source = _source(folder)
    if not numbers or source == "unknown":
        return None
    whence = "calibration and actuation as the station file states them"
    if source == "calibration":
        whence = "the calibration's residuals (actuation is not stated)"
    return StationError(
        sum(value**2 for key, value in numbers.items() if key.endswith("_translation")),
        sum(value**2 for key, value in numbers.items() if key.endswith("_rotation")),
        whence,
    )


def session_pose_error(
    trials: Sequence[LabeledTrial], station: StationError | None
) -> StatedPoseError | None:
    """Root mean square of the registrations' own deviations, and the station's beside them.

    Args:
        trials: those that count.
        station: None if not stated.
    """
    claimed = claimed_variances(trials)
    if claimed is None:
        return None
    variances, count = claimed
    translation, rotation = variances[3:].mean(), variances[:3].mean()
    basis = f"root mean square of {count} registrations' stated covariances"
    if station is not None:
        translation, rotation = translation + station.translation, rotation + station.rotation
        basis += f", and {station.whence}"
    else:
        basis += "; calibration and actuation not stated, and not included"
    return StatedPoseError(_stated(translation), _stated(rotation), basis)


def table_height(folder: SessionFolder) -> float:
    """World z of the station's table [m]; zero where no station file says otherwise."""
    return _section(folder, "workspace").get("table_height", 0.0)


def _section(folder: SessionFolder, name: str) -> dict[str, float]:
    """The numbers in a section of the station file; empty if there is no such section."""
    station = folder.descriptor.config.get("station")
    section = station.get(name) if isinstance(station, dict) else None
    items = section.items() if isinstance(section, dict) else ()
    return {key: float(value) for key, value in items if isinstance(value, int | float)}


def _source(folder: SessionFolder) -> str:
    """Who says how large the station's errors are; sessions before this was kept: the file."""
    station = folder.descriptor.config.get("station")
    section = station.get("pose_error") if isinstance(station, dict) else None
    return str(section.get("source", "stated")) if isinstance(section, dict) else "unknown"


def _stated(variance: float) -> float:
    """Standard deviation to two digits: more are noise, and every new trial would change them.

    Cached scores hold under one pose error; a session that goes on keeps them.
    """
    return float(f"{np.sqrt(variance):.1e}")
