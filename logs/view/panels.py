"""The view's flat part: images, plots, events, text."""

from __future__ import annotations

from collections import Counter

import numpy as np
import rerun as rr

from logs.record.annotations import Annotations
from logs.record.records import Severity
from logs.record.streams import DepthImage
from logs.record.trial_record import TrialRecord
from logs.view.stage import Stage
from logs.view.text import summary

COLOR, OTHER_COLOR, DEPTH = "images/color", "images/other_color", "images/depth"
WIDTH, FORCE, JOINTS = "plots/width", "plots/force", "plots/joints"
PHASE, EVENTS, SUMMARY = "phase", "events", "summary"
DEPTH_STEPS = 10_000
"""Depth is shown in steps of 0.1 mm; the record has it exactly."""
_LEVEL = {Severity.INFO: "INFO", Severity.WARNING: "WARN", Severity.ERROR: "ERROR"}
_SERIES = [(86, 148, 214), (244, 162, 54), (98, 190, 120), (219, 92, 104), (196, 120, 200),
           (130, 200, 210), (240, 224, 94)]  # fmt: skip


def show_panels(
    stage: Stage, record: TrialRecord, annotations: Annotations, *, blind: bool
) -> None:
    """Show everything that is not in the world."""
    _show_images(stage, record)
    _show_plots(stage, record)
    _show_events(stage, record)
    text = summary(record, annotations, blind=blind)
    stage.static(SUMMARY, rr.TextDocument(text, media_type="text/markdown"))


def _show_images(stage: Stage, record: TrialRecord) -> None:
    for image in record.depth:
        stage.at(f"{DEPTH}/{image.camera}", image.time_ns, _depth_image(image))
    first = _main_camera(record)
    for frame in record.color:
        shown = rr.EncodedImage(contents=frame.data, media_type=f"image/{frame.format}")
        entity = COLOR if frame.camera == first else f"{OTHER_COLOR}/{frame.camera}"
        stage.at(entity, frame.time_ns, shown)


def _main_camera(record: TrialRecord) -> str | None:
    """The camera that saw most of the trial: the others' pictures would lie over its own."""
    frames = Counter(frame.camera for frame in record.color)
    return max(sorted(frames), key=frames.__getitem__, default=None)


def _depth_image(image: DepthImage) -> rr.DepthImage:
    meters = np.nan_to_num(image.meters(), nan=0.0)
    steps = np.rint(np.clip(meters * DEPTH_STEPS, 0, 65535)).astype(np.uint16)
    seen = steps[steps > 0]
    near, far = np.percentile(seen, [2, 98]) if len(seen) else (0, 1)
    return rr.DepthImage(
        steps, meter=DEPTH_STEPS, colormap="viridis", depth_range=[float(near), float(far) + 1]
    )


def _show_plots(stage: Stage, record: TrialRecord) -> None:
    jaw = record.jaw
    if len(jaw.time_ns):
        stage.static(WIDTH, rr.SeriesLines(colors=[_SERIES[0]], names=["width [mm]"]))
        stage.columns(WIDTH, jaw.time_ns, rr.Scalars.columns(scalars=jaw.widths * 1e3))
        known = np.isfinite(jaw.forces)
        if known.any():
            stage.static(FORCE, rr.SeriesLines(colors=[_SERIES[1]], names=["force [N]"]))
            columns = rr.Scalars.columns(scalars=jaw.forces[known])
            stage.columns(FORCE, jaw.time_ns[known], columns)
    for track in record.joints:
        for number, name in enumerate(track.names):
            entity = f"{JOINTS}/{name}"
            color = _SERIES[number % len(_SERIES)]
            stage.static(entity, rr.SeriesLines(colors=[color], names=[f"{name} [rad]"]))
            columns = rr.Scalars.columns(scalars=track.positions[:, number])
            stage.columns(entity, track.time_ns, columns)


def _show_events(stage: Stage, record: TrialRecord) -> None:
    if not record.events:
        return
    texts = [
        f"{event.name}: {event.message}" if event.message else event.name for event in record.events
    ]
    times = np.array([event.time_ns for event in record.events], dtype=np.int64)
    levels = [_LEVEL[event.severity] for event in record.events]
    stage.columns(EVENTS, times, rr.TextLog.columns(text=texts, level=levels))
    for phase in record.phases:
        stage.at(PHASE, phase.time_ns, rr.StateChange(state=phase.name))
