"""Does the station stay the same? Residuals and success in the order the trials were run.

A session's segments are shown apart: between them the set-up was changed and accepted, so that a
step is expected there and a trend over it would mean nothing.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import groupby
from typing import TYPE_CHECKING, Any

import numpy as np

from logs.dataset.registration_residual import resting_residual
from logs.report.charts import FAILURE_COLOR, MODEL_COLORS, SUCCESS_COLOR, figure, to_svg
from reach.arrays import FloatArray

if TYPE_CHECKING:
    from logs.dataset.dataset import Dataset
    from logs.dataset.labeled_trial import LabeledTrial

FEWEST = 6
"""Fewer trials show no trend."""
RASTER_ABOVE = 300
"""More dots than this are drawn as a picture inside the chart: smaller, and quicker to show."""


@dataclass(frozen=True, slots=True)
class Redone:
    """How many of some trials had been redone before the take that counts."""

    redone: int
    trials: int


@dataclass(frozen=True, slots=True)
class Segment:
    """Consecutive trials of one session under one set-up.

    Args:
        name: session, and number of its segment.
        start: index of its first trial.
        stop: index behind its last one.
        share: of its trials that were stably lifted.
        redone: by outcome, `lifted` and `failed`.
        trend: change of tilt [rad] and of height [m] from its beginning to its end, each with the
            standard error of its straight line; absent with too few trials.
    """

    name: str
    start: int
    stop: int
    share: float
    redone: Mapping[str, Redone]
    trend: Mapping[str, tuple[float, float]]


@dataclass(frozen=True, slots=True, eq=False)
class Drift:
    """Series over the trials in the order they were run; NaN where nothing was registered.

    Args:
        success: 1 or 0, shape (N,).
        tilt: angle between the planned and the registered vertical [rad], shape (N,).
        height: registered above planned height [m], shape (N,).
        segments: in the same order; together all trials.
    """

    success: FloatArray
    tilt: FloatArray
    height: FloatArray
    segments: tuple[Segment, ...]


def measure_drift(dataset: Dataset) -> Drift | None:
    """The series of a data set; None with too few trials, or trials without times."""
    trials = [trial for trial in dataset.trials if trial.execution.time_ns is not None]
    if len(trials) < FEWEST:
        return None
    trials.sort(key=lambda trial: trial.execution.time_ns or 0)
    success = np.array([float(trial.label.success) for trial in trials])
    tilt, height = np.array([_residual(trial) for trial in trials]).T
    segments, start = [], 0
    for name, group in groupby(trials, key=lambda t: f"{t.session}, segment {t.segment + 1}"):
        own = list(group)
        segments.append(_segment(name, start, own, tilt, height))
        start += len(own)
    return Drift(success, tilt, height, tuple(segments))


def drift_svg(drift: Drift, name: str = "drift") -> str:
    """Three panels: success, tilt, height; lines between the segments."""
    at = np.arange(1.0, len(drift.success) + 1)
    with figure((10.0, 2.5), panels=3) as (canvas, panels):
        first, second, third = panels
        window = max(5, len(at) // 20)
        mean = np.concatenate(
            [_running_mean(drift.success[s.start : s.stop], window) for s in drift.segments]
        )
        _line(first, drift, mean)
        lifted = drift.success > 0
        raster = len(at) > RASTER_ABOVE
        for where, height, color in (
            (lifted, 1.04, SUCCESS_COLOR),
            (~lifted, -0.04, FAILURE_COLOR),
        ):
            marks = np.full(where.sum(), height)
            first.scatter(at[where], marks, s=5, color=color, lw=0, rasterized=raster)
        first.set(ylim=(-0.1, 1.1), title=f"success, mean of {window}")
        _dots(second, at, np.degrees(drift.tilt), "tilt against plan [deg]")
        _dots(third, at, drift.height * 1e3, "height against plan [mm]")
        for axes in panels:
            axes.set_xlabel("trial, in the order run")
            axes.title.set_fontsize(10)
            for segment in drift.segments[1:]:
                axes.axvline(segment.start + 0.5, color="#94a3b8", lw=1, ls=(0, (3, 2)))
        return to_svg(canvas, name)


def _segment(
    name: str, start: int, trials: Sequence[LabeledTrial], tilt: FloatArray, height: FloatArray
) -> Segment:
    stop = start + len(trials)
    trends = {"tilt": _trend(tilt[start:stop]), "height": _trend(height[start:stop])}
    redone = {
        outcome: Redone(sum(bool(t.redos) for t in part), len(part))
        for outcome, part in (
            ("lifted", [t for t in trials if t.label.success]),
            ("failed", [t for t in trials if not t.label.success]),
        )
    }
    return Segment(
        name,
        start,
        stop,
        redone["lifted"].trials / len(trials),
        redone,
        {key: trend for key, trend in trends.items() if trend is not None},
    )


def _residual(trial: LabeledTrial) -> tuple[float, float]:
    """Tilt [rad] and height [m] of the registered pose against the planned one."""
    found = resting_residual(trial)
    return (np.nan, np.nan) if found is None else (found.tilt, found.height)


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
    """Mean of the last values up to a window; NaN before the window has filled."""
    total = np.cumsum(np.insert(values, 0, 0.0))
    mean = np.full(len(values), np.nan)
    mean[window - 1 :] = (total[window:] - total[:-window]) / window
    return mean


def _line(axes: Any, drift: Drift, values: FloatArray) -> None:
    """One line a segment."""
    for s in drift.segments:
        at = np.arange(s.start + 1, s.stop + 1)
        axes.plot(at, values[s.start : s.stop], color=MODEL_COLORS["reach"], lw=1.6)


def _dots(axes: Any, at: FloatArray, values: FloatArray, title: str) -> None:
    raster = len(at) > RASTER_ABOVE
    alpha = 0.35 if raster else 0.7
    axes.scatter(at, values, s=9, color=MODEL_COLORS["reach"], alpha=alpha, lw=0, rasterized=raster)
    axes.set_title(title)
