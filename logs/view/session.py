"""All trials of a session in one Rerun recording: one step a trial, disagreements first.

The recording has four timelines that order the same trials differently (by disagreement, by
number, by object, by outcome). Every step sets everything it shows, so that each order shows the
right state.
"""

from __future__ import annotations

import io
from collections.abc import Mapping, Sequence
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import rerun as rr

from logs.errors import RecordReadError, ViewError
from logs.record.annotation_files import read_annotations
from logs.record.annotations import ScoreRecord
from logs.record.outline import first_image, read_outline
from logs.record.streams import ColorImage
from logs.record.trial_record import record_path
from logs.session.folder import SessionFolder
from logs.session.index import list_takes
from logs.view import colors
from logs.view import session_blueprint as layout
from logs.view.contacts import (
    PROUD,
    brightest_pressure,
    force_arrows,
    model_with_contacts,
    pressure_rgba,
)
from logs.view.file import view_file
from logs.view.session_overview import OverviewRow, counting, judging_model, overview
from logs.view.session_poses import SessionPoses
from logs.view.session_text import contents, headline
from logs.view.stage import flat_mesh
from logs.view.text import escaped, summary

APPLICATION = "reach-trials session"
PICTURES = 300
"""Only this many trials, worst disagreements first, carry a picture: it must be decoded."""
PICTURE_SIZE = (400, 300)
"""Of all pictures [pixel]: the viewer reports an error when a picture's size changes."""
_NO_TRIANGLE = np.zeros((1, 3, 3))
"""Drawn where there is no contact: a viewer that loads a file piece by piece ignores `Clear`."""


def write_session_view(session: Path, out: Path, model: str | None = None) -> Path:
    """Write the session's view.

    Args:
        session: the session's folder.
        out: the .rrd file.
        model: whose disagreements come first; a good one if None.

    Raises:
        NotASessionError: if the folder is no session.
        ViewError: if there is nothing to show, or the file cannot be written.
    """
    folder = SessionFolder.open(session)
    takes = list_takes(session)
    judge = judging_model(counting(takes), model)
    shown = overview(takes, judge)
    if not shown:
        raise ViewError(f"{session} has no executed trial to show yet")
    blueprint = layout.session_blueprint(judge)
    with view_file(APPLICATION, folder.descriptor.session_id, out, blueprint) as recording:
        name = folder.path.resolve().name
        recording.send_recording_name(f"all trials of {name}")
        _SessionDrawing(recording, folder, judge).draw(shown)
        text = rr.TextDocument(contents(name, shown, judge), media_type="text/markdown")
        recording.log(layout.CONTENTS, text, static=True)
    return out


class _SessionDrawing:
    """Draws step by step what is large, and at the end, in columns, what is small."""

    def __init__(self, recording: Any, folder: SessionFolder, judge: str | None) -> None:
        self._recording = recording
        self._folder = folder
        self._judge = judge
        self._poses = SessionPoses(recording)

    def draw(self, shown: Sequence[OverviewRow]) -> None:
        for number, item in enumerate(shown):
            for timeline, place in item.places.items():
                self._recording.set_time(timeline, sequence=place)
            self._draw_trial(item, picture=number < PICTURES)
        self._recording.reset_time()
        self._poses.send([item.places for item in shown])
        self._send_list(shown)
        self._send_scores(shown)

    def _draw_trial(self, item: OverviewRow, *, picture: bool) -> None:
        folder = self._folder.path / item.row.folder
        annotations = read_annotations(folder)
        scores = annotations.newest_scores
        try:
            path = record_path(folder)
            record = read_outline(path)
        except RecordReadError as error:
            self._poses.add_nothing()
            self._draw_contacts({})
            self._draw_picture(None)
            self._log(
                layout.SUMMARY, _markdown(f"### Trial {item.row.number}\n\n{escaped(str(error))}")
            )
            return
        self._poses.add(item.row.object_name, path, record, scores)
        self._draw_contacts(scores)
        self._draw_picture(path if picture else None)
        hint = f"`reach replay {self._folder.path} --trial {item.row.number}` shows all of it."
        text = summary(record, annotations, blind=False)
        self._log(layout.SUMMARY, _markdown(f"{text}\n\n{hint}"))

    def _draw_contacts(self, scores: Mapping[str, ScoreRecord]) -> None:
        model = model_with_contacts(dict(scores))
        patches = scores[model].patches if model else ()
        shapes = [_NO_TRIANGLE, *(p.triangles_object - PROUD * p.normal_object for p in patches)]
        shades = [np.zeros((3, 4), np.uint8)]
        if model:
            highest = brightest_pressure(scores[model])
            shades += [pressure_rgba(patch, highest) for patch in patches]
        mesh = flat_mesh(np.concatenate(shapes), None, np.concatenate(shades))
        self._log(f"{layout.CONTACTS}/pressure", mesh)
        self._log(f"{layout.CONTACTS}/force", force_arrows(patches, self._poses.diameter))

    def _draw_picture(self, path: Path | None) -> None:
        picture = (_picture(path) if path else None) or _no_picture()
        self._log(layout.PICTURE, rr.EncodedImage(contents=picture, media_type="image/jpeg"))

    def _send_list(self, shown: Sequence[OverviewRow]) -> None:
        texts = [headline(item, self._judge) for item in shown]
        levels = ["WARN" if self._judge in item.wrong else "INFO" for item in shown]
        self._send(layout.LIST, shown, rr.TextLog.columns(text=texts, level=levels))

    def _send_scores(self, shown: Sequence[OverviewRow]) -> None:
        labeled = [item for item in shown if item.row.outcome is not None]
        values = [float(item.row.outcome == "success") for item in labeled]
        self._send(f"{layout.SCORES}/label", labeled, rr.Scalars.columns(scalars=values))
        for model in sorted({model for item in shown for model in item.row.scores}):
            scored = [item for item in shown if model in item.row.scores]
            values = [item.row.scores[model] for item in scored]
            self._send(f"{layout.SCORES}/{model}", scored, rr.Scalars.columns(scalars=values))

    def _send(self, entity: str, shown: Sequence[OverviewRow], columns: Any) -> None:
        if shown:
            steps = layout.time_columns([item.places for item in shown])
            self._recording.send_columns(entity, indexes=steps, columns=columns)

    def _log(self, entity: str, what: Any) -> None:
        self._recording.log(entity, what)


def _markdown(text: str) -> Any:
    return rr.TextDocument(text, media_type="text/markdown")


def _picture(path: Path) -> bytes | None:
    """A record's first color frame, small, or its depth image in gray, as JPEG."""
    from PIL import Image

    found = first_image(path)
    if found is None:
        return None
    if isinstance(found, ColorImage):
        image = Image.fromarray(found.pixels())
    else:
        depth = found.meters()
        near, far = np.nanpercentile(depth, [2, 98]) if np.isfinite(depth).any() else (0.0, 1.0)
        shade = np.nan_to_num((far - depth) / max(far - near, 1e-6), nan=0.0).clip(0, 1)
        image = Image.fromarray((shade * 255).astype(np.uint8), "L")
    image.thumbnail(PICTURE_SIZE)
    return _jpeg(image)


@cache
def _no_picture() -> bytes:
    """What stands where a step has no picture."""
    from PIL import Image, ImageDraw

    image = Image.new("RGB", PICTURE_SIZE, colors.BACKGROUND[:3])
    text = f"only the first {PICTURES} steps by disagreement have a picture"
    ImageDraw.Draw(image).text((16, 140), text, fill=colors.JOINTED[:3])
    return _jpeg(image)


def _jpeg(image: Any) -> bytes:
    """An image in the middle of a picture of the one size."""
    from PIL import Image

    canvas = Image.new("RGB", PICTURE_SIZE, colors.BACKGROUND[:3])
    width, height = image.size
    canvas.paste(image, ((PICTURE_SIZE[0] - width) // 2, (PICTURE_SIZE[1] - height) // 2))
    buffer = io.BytesIO()
    canvas.save(buffer, "jpeg", quality=85)
    return buffer.getvalue()
