"""How the session's view is laid out."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import rerun as rr
import rerun.blueprint as rrb

from logs.view import colors
from logs.view.session_overview import TIMELINES

SCENE = "scene"
OBJECTS, HAND, CONTACTS = f"{SCENE}/objects", f"{SCENE}/hand", f"{SCENE}/contacts"
SETTLING = f"{SCENE}/predicted_settling"
PICTURE, SUMMARY, LIST, SCORES, CONTENTS = "picture", "summary", "trials", "scores", "contents"
_LABEL_POINT, _SCORE_POINT = (98, 190, 120), (244, 162, 54)


def time_columns(places: Sequence[Mapping[str, int]]) -> list[Any]:
    """Steps on all timelines, for columns."""
    return [rr.TimeColumn(one, sequence=[place[one] for place in places]) for one in TIMELINES]


def session_blueprint(model: str | None) -> Any:
    """The scene of one trial, its picture and text, and the list of all trials.

    Args:
        model: whose scores are plotted against the labels.
    """
    trials = rrb.TextLogView(
        origin=LIST,
        name="trials: click a step to go there",
        columns=rrb.TextLogColumns(text_log_columns=["loglevel", "body"]),
    )
    grasp = _scene("grasp", [f"{SCENE}/**"], (0.03, -0.19, 0.10))
    contact = [f"{OBJECTS}/**", f"{CONTACTS}/**"]
    return rrb.Blueprint(
        rrb.Horizontal(
            rrb.Vertical(
                rrb.Horizontal(grasp, _scene("predicted contact", contact, (0.05, -0.12, 0.09))),
                trials,
                row_shares=[3, 2],
            ),
            rrb.Vertical(
                rrb.Tabs(
                    rrb.TextDocumentView(origin=SUMMARY, name="trial"),
                    rrb.TextDocumentView(origin=CONTENTS, name="how to browse"),
                ),
                rrb.Spatial2DView(origin=PICTURE, name="picture"),
                _scores(model),
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


def _scene(name: str, contents: list[str], eye: tuple[float, float, float]) -> Any:
    return rrb.Spatial3DView(
        origin=SCENE,
        name=name,
        contents=contents,
        background=colors.BACKGROUND,
        line_grid=rrb.LineGrid3D(visible=True, spacing=0.02, color=(70, 76, 88, 255)),
        eye_controls=rrb.EyeControls3D(
            kind=rrb.Eye3DKind.Orbital,
            position=eye,
            look_target=(0.0, 0.0, 0.025),
            eye_up=(0, 0, 1),
        ),
    )


def _scores(model: str | None) -> Any:
    scored = [f"{SCORES}/{model}"] if model else []
    points = {
        f"{SCORES}/label": ("label", _LABEL_POINT),
        **{entity: (model or "", _SCORE_POINT) for entity in scored},
    }
    return rrb.TimeSeriesView(
        origin=SCORES,
        name=f"label and {model}" if model else "labels",
        contents=list(points),
        overrides={
            entity: rr.SeriesPoints(colors=[color], marker_sizes=[3.0], names=[name])
            for entity, (name, color) in points.items()
        },
        axis_y=rrb.ScalarAxis(range=(-0.05, 1.05)),
    )
