"""How the session's view is laid out."""

from __future__ import annotations

from typing import Any

import rerun as rr
import rerun.blueprint as rrb

from logs import view_colors as colors
from logs.session_overview import TIMELINES

SCENE = "scene"
OBJECTS, HAND, CONTACTS = f"{SCENE}/objects", f"{SCENE}/hand", f"{SCENE}/contacts"
PICTURE, SUMMARY, LIST, SCORES = "picture", "summary", "trials", "scores"
_LABEL_POINT, _SCORE_POINT = (98, 190, 120), (244, 162, 54)


def session_blueprint(model: str | None) -> Any:
    """The scene of one trial, its picture and text, and the list of all trials.

    Args:
        model: whose scores are plotted against the labels.
    """
    scene = rrb.Spatial3DView(
        origin=SCENE,
        name="grasp and predicted contact",
        background=colors.BACKGROUND,
        line_grid=rrb.LineGrid3D(visible=True, spacing=0.02, color=(70, 76, 88, 255)),
        eye_controls=rrb.EyeControls3D(
            kind=rrb.Eye3DKind.Orbital,
            position=(0.10, -0.22, 0.15),
            look_target=(0.0, 0.0, 0.03),
            eye_up=(0, 0, 1),
        ),
    )
    trials = rrb.TextLogView(
        origin=LIST,
        name="trials: click a step to go there",
        columns=rrb.TextLogColumns(text_log_columns=["loglevel", "body"]),
    )
    scores = rrb.TimeSeriesView(
        origin=SCORES,
        name=f"label and {model}" if model else "labels",
        contents=[f"{SCORES}/label", *([f"{SCORES}/{model}"] if model else [])],
        overrides={
            f"{SCORES}/label": rr.SeriesPoints(
                colors=[_LABEL_POINT], marker_sizes=[3.0], names=["label"]
            ),
            f"{SCORES}/{model}": rr.SeriesPoints(
                colors=[_SCORE_POINT], marker_sizes=[3.0], names=[model or ""]
            ),
        },
        axis_y=rrb.ScalarAxis(range=(-0.05, 1.05)),
    )
    return rrb.Blueprint(
        rrb.Horizontal(
            rrb.Vertical(scene, trials, row_shares=[3, 2]),
            rrb.Vertical(
                rrb.TextDocumentView(origin=SUMMARY, name="trial"),
                rrb.Spatial2DView(origin=PICTURE, name="picture"),
                scores,
                row_shares=[3, 2, 2],
            ),
            column_shares=[3, 2],
        ),
        rrb.TimePanel(state="collapsed", timeline=TIMELINES[0], play_state="paused"),
        rrb.BlueprintPanel(state="collapsed"),
        rrb.SelectionPanel(state="collapsed"),
        auto_layout=False,
        auto_views=False,
    )
