"""Does the station stay the same? Residuals and success in the order the trials were run."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from logs.report.charts import FAILURE_COLOR, MODEL_COLORS, SUCCESS_COLOR, figure, to_svg
from reach.arrays import FloatArray

if TYPE_CHECKING:
    from logs.dataset import Dataset
    from logs.labeled_trial import LabeledTrial

FEWEST = 6
"""Fewer trials show no trend."""


@dataclass(frozen=True, slots=True, eq=False)
class Drift:
    """Series over the trials in the order they were run; NaN where nothing was registered.

    Args:
        success: 1 or 0, shape (N,).
        tilt: angle between the planned and the registered vertical [rad], shape (N,).
        height: registered above planned height [m], shape (N,).
        trend: change of tilt and of height over the whole run, each with the standard error of
            its straight line; None with too few trials.
    """

    success: FloatArray
    tilt: FloatArray
    height: FloatArray
    trend: dict[str, tuple[float, float]]


def measure_drift(dataset: Dataset) -> Drift | None:
    """The series of a data set; None with too few trials, or trials without times."""
    trials = [trial for trial in dataset.trials if trial.execution.time_ns is not None]
    if len(trials) < FEWEST:
        return None
    trials.sort(key=lambda trial: trial.execution.time_ns or 0)
    tilt, height = np.array([_residual(trial) for trial in trials]).T
    trends = {"tilt": _trend(tilt), "height": _trend(height)}
    return Drift(
        np.array([float(trial.label.success) for trial in trials]),
        tilt,
        height,
        {name: trend for name, trend in trends.items() if trend is not None},
    )


def drift_svg(drift: Drift, name: str = "drift") -> str:
    """Three panels: success, tilt, height."""
    at = np.arange(1.0, len(drift.success) + 1)
    with figure((10.0, 2.5), panels=3) as (canvas, (first, second, third)):
        window = max(5, len(at) // 8)
        first.plot(at, _running_mean(drift.success, window), color=MODEL_COLORS["reach"], lw=1.6)
        lifted = drift.success > 0
        first.scatter(at[lifted], np.full(lifted.sum(), 1.04), s=5, color=SUCCESS_COLOR, lw=0)
        first.scatter(at[~lifted], np.full((~lifted).sum(), -0.04), s=5, color=FAILURE_COLOR, lw=0)
        first.set(ylim=(-0.1, 1.1), title=f"success, mean of {window}")
        _dots(second, at, np.degrees(drift.tilt), "tilt against plan [deg]")
        _dots(third, at, drift.height * 1e3, "height against plan [mm]")
        for axes in (first, second, third):
            axes.set_xlabel("trial, in the order run")
            axes.title.set_fontsize(10)
        return to_svg(canvas, name)


def _residual(trial: LabeledTrial) -> tuple[float, float]:
    """Tilt [rad] and height [m] of the registered pose against the planned one."""
    registered = trial.execution.T_world_object
    if registered is None:
        return np.nan, np.nan
    cosine = float(registered[2, :3] @ trial.T_world_object[2, :3])
    if cosine < 0.5:  # the part was put down on another side
        return np.nan, np.nan
    tilt = float(np.arccos(np.clip(cosine, -1, 1)))
    return tilt, float(registered[2, 3] - trial.T_world_object[2, 3])


def _trend(values: FloatArray) -> tuple[float, float] | None:
    known = np.isfinite(values)
    if known.sum() < FEWEST:
        return None
    x = np.linspace(0.0, 1.0, len(values))[known]
    y = values[known]
    slope, offset = np.polyfit(x, y, 1)
    rest = y - (slope * x + offset)
    error = np.sqrt((rest**2).sum() / (len(y) - 2) / ((x - x.mean()) ** 2).sum())
    return float(slope), float(error)


def _running_mean(values: FloatArray, window: int) -> FloatArray:
    total = np.cumsum(np.insert(values, 0, 0.0))
    starts = np.maximum(np.arange(1, len(values) + 1) - window, 0)
    ends = np.arange(1, len(values) + 1)
    mean: FloatArray = (total[ends] - total[starts]) / (ends - starts)
    return mean


def _dots(axes: Any, at: FloatArray, values: FloatArray, title: str) -> None:
    axes.scatter(at, values, s=9, color=MODEL_COLORS["reach"], alpha=0.7, lw=0)
    axes.set_title(title)
