"""How a view is laid out: what stands where, from where the scene is seen."""

from __future__ import annotations

from typing import Any

import numpy as np
import rerun.blueprint as rrb

from logs import view_colors as colors
from logs import view_panels as panels
from logs.trial_record import TrialRecord
from logs.view_contacts import CONTACTS
from logs.view_scene import OBJECT, WORLD
from logs.view_stage import ELAPSED
from reach.arrays import FloatArray

SCENE_EYE = np.array([0.33, -0.42, 0.27])
"""From the object to the scene's eye: beside the table, looking down at the hand [m]."""
CONTACT_EYE = np.array([1.0, -1.3, 0.8])
"""Direction from the object to the eye that looks at the contacts."""


def trial_blueprint(record: TrialRecord, model: str | None, diameter: float) -> Any:
    """Everything that is known of a trial.

    Args:
        record: the trial.
        model: whose contacts are shown, if any.
        diameter: of the object [m].
    """
    pictures = _pictures(record)
    if model is not None:
        pictures.append(_contacts(record, model, diameter))
    return _layout(record, pictures, "label and scores")


def blind_blueprint(record: TrialRecord) -> Any:
    """What an operator may see before the label: no contacts, pressures or scores."""
    return _layout(record, _pictures(record), "trial")


def _layout(record: TrialRecord, pictures: list[Any], text_name: str) -> Any:
    scene: Any = _scene(record)
    left = rrb.Vertical(scene, rrb.Horizontal(*pictures), row_shares=[5, 3]) if pictures else scene
    right = rrb.Vertical(
        rrb.TextDocumentView(origin=panels.SUMMARY, name=text_name),
        *_plots(record),
        rrb.Tabs(
            rrb.TextLogView(
                origin=panels.EVENTS,
                name="events",
                columns=rrb.TextLogColumns(text_log_columns=["loglevel", "body"]),
            ),
            rrb.StateTimelineView(origin=panels.PHASE, name="phases"),
        ),
        row_shares=[5] + [2] * len(_plots(record)) + [2],
    )
    return rrb.Blueprint(
        rrb.Horizontal(left, right, column_shares=[5, 3]),
        rrb.TimePanel(state="collapsed", timeline=ELAPSED),
        rrb.BlueprintPanel(state="collapsed"),
        rrb.SelectionPanel(state="collapsed"),
        auto_layout=False,
        auto_views=False,
    )


def _scene(record: TrialRecord) -> Any:
    target = _object_position(record) + (0.0, 0.0, 0.07)
    return rrb.Spatial3DView(
        origin=WORLD,
        name="scene",
        contents=[
            "$origin/**",
            f"- {WORLD}/rivals/**",
            f"- {OBJECT}/glass/**",
            f"- {CONTACTS}/**",
        ],
        background=colors.BACKGROUND,
        line_grid=rrb.LineGrid3D(visible=False),
        eye_controls=rrb.EyeControls3D(
            kind=rrb.Eye3DKind.Orbital,
            position=target + SCENE_EYE,
            look_target=target,
            eye_up=(0, 0, 1),
        ),
    )


def _contacts(record: TrialRecord, model: str, diameter: float) -> Any:
    """The object as glass with a model's patches, in the object's own frame."""
    eye = CONTACT_EYE / np.linalg.norm(CONTACT_EYE) * max(2.2 * diameter, 0.05)
    return rrb.Spatial3DView(
        origin=OBJECT,
        name=f"contact predicted by {model}",
        contents=[f"{OBJECT}/glass", f"{CONTACTS}/{model}/**"],
        background=colors.BACKGROUND,
        line_grid=rrb.LineGrid3D(visible=False),
        eye_controls=rrb.EyeControls3D(
            kind=rrb.Eye3DKind.Orbital,
            position=eye,
            look_target=(0, 0, 0),
            eye_up=(0, 0, 1),
        ),
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


def _object_position(record: TrialRecord) -> FloatArray:
    found = record.registration
    T = found.T_world_object if found else record.descriptor.T_world_object
    return np.array(T[:3, 3])
