"""How a view is laid out: what stands where, from where the scene is seen."""

from __future__ import annotations

from typing import Any

import numpy as np
import rerun.blueprint as rrb

from logs.record.trial_record import TrialRecord
from logs.view import colors, panels
from logs.view.contacts import CONTACTS, SHOWN_CONTACTS
from logs.view.eyes import CONTACT_ANCHOR, SCENE_ANCHOR
from logs.view.object import OBJECT, WORLD
from logs.view.stage import ELAPSED
from reach.arrays import FloatArray

SCENE_EYE = np.array([0.08, -0.26, 0.16])
"""From the object to the scene's eye: before it, looking at the hand, and the robot [m]."""
CONTACT_EYE = np.array([0.045, -0.058, 0.032])
"""From an object of unit size to the eye that looks at its contacts; see the anchor's scale."""


def trial_blueprint(record: TrialRecord) -> Any:
    """Everything that is known of a trial.

    The viewer keeps the first layout it gets for all recordings of an application, so nothing
    here depends on where an object lies, how large it is, or which model scored it: the views
    look from anchors that each recording places.
    """
    contacts = rrb.Spatial3DView(
        origin=CONTACT_ANCHOR,
        name="predicted contact",
        contents=[f"{OBJECT}/glass", f"{SHOWN_CONTACTS}/**"],
        background=colors.BACKGROUND,
        line_grid=rrb.LineGrid3D(visible=False),
        eye_controls=_eye(CONTACT_EYE, (0.0, 0.0, 0.0)),
    )
    return _layout(record, [*_pictures(record), contacts], "label and scores")


def blind_blueprint(record: TrialRecord) -> Any:
    """What an operator may see before the label: no contacts, pressures or scores."""
    return _layout(record, _pictures(record), "trial")


def _layout(record: TrialRecord, pictures: list[Any], text_name: str) -> Any:
    scene: Any = _scene()
    left = rrb.Vertical(scene, rrb.Horizontal(*pictures), row_shares=[5, 3]) if pictures else scene
    plots = _plots(record)
    events = rrb.TextLogView(
        origin=panels.EVENTS,
        name="events",
        columns=rrb.TextLogColumns(text_log_columns=["loglevel", "body"]),
    )
    right = rrb.Vertical(
        rrb.TextDocumentView(origin=panels.SUMMARY, name=text_name),
        *plots,
        rrb.Tabs(events, rrb.StateTimelineView(origin=panels.PHASE, name="phases")),
        row_shares=[5] + [2] * len(plots) + [2],
    )
    return rrb.Blueprint(
        rrb.Horizontal(left, right, column_shares=[5, 3]),
        rrb.TimePanel(state="collapsed", timeline=ELAPSED),
        rrb.BlueprintPanel(state="collapsed"),
        rrb.SelectionPanel(state="collapsed"),
        auto_layout=False,
        auto_views=False,
    )


def _scene() -> Any:
    return rrb.Spatial3DView(
        origin=SCENE_ANCHOR,
        name="scene",
        contents=[
            f"{WORLD}/**",
            f"- {WORLD}/rivals/**",
            f"- {OBJECT}/glass/**",
            f"- {CONTACTS}/**",
        ],
        background=colors.BACKGROUND,
        line_grid=rrb.LineGrid3D(visible=False),
        eye_controls=_eye(SCENE_EYE, (0.0, 0.0, 0.06)),
    )


def _eye(position: FloatArray, target: tuple[float, float, float]) -> Any:
    return rrb.EyeControls3D(
        kind=rrb.Eye3DKind.Orbital,
        position=position,
        look_target=target,
        eye_up=(0, 0, 1),
    )


def _pictures(record: TrialRecord) -> list[Any]:
    shown: list[Any] = []
    if record.color:
        shown.append(rrb.Spatial2DView(origin=panels.COLOR, name="color"))
    if record.depth:
        shown.append(rrb.Spatial2DView(origin=panels.DEPTH, name="depth"))
    return shown


def _plots(record: TrialRecord) -> list[Any]:
    shown: list[Any] = []
    if len(record.jaw.time_ns):
        shown.append(rrb.TimeSeriesView(origin=panels.WIDTH, name="jaw width [mm]"))
        if np.isfinite(record.jaw.forces).any():
            shown.append(rrb.TimeSeriesView(origin=panels.FORCE, name="jaw force [N]"))
    if record.joints:
        shown.append(
            rrb.TimeSeriesView(
                origin=panels.JOINTS, name="joints [rad]", plot_legend=rrb.PlotLegend(visible=False)
            )
        )
    return shown
