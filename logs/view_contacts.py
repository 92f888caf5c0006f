"""Predicted contacts: patches colored by pressure, and each pad's force."""

from __future__ import annotations

import numpy as np
import rerun as rr

from logs import view_colors as colors
from logs.annotations import PatchRecord, ScoreRecord
from logs.view_object import OBJECT
from logs.view_stage import Stage, flat_mesh

CONTACTS = f"{OBJECT}/contacts"
SHOWN_CONTACTS = f"{CONTACTS}/shown"
"""Contacts of the model that the view shows first."""
CONTACT_ANCHOR = f"{OBJECT}/eye"
"""From here the contacts are looked at: scaled so that every object looks as large."""
UNIT_DIAMETER = 0.052
"""Diagonal that an object seems to have in the anchor's frame [m]."""
PROUD = 2e-4
"""Patches stand off the surface by this, so that they are not drawn inside it [m]."""
FORCE_SCALE = 0.002
"""Length of a force arrow [m/N]."""
PREFERRED = "reach"


def show_contacts(stage: Stage, scores: dict[str, ScoreRecord], diameter: float) -> None:
    """Draw the contacts that each model predicts, in the object's frame.

    Args:
        stage: where.
        scores: newest score of each model.
        diameter: of the object [m].
    """
    first = model_with_contacts(scores)
    stage.static(CONTACT_ANCHOR, rr.Transform3D(scale=diameter / UNIT_DIAMETER))
    for model, score in scores.items():
        highest = highest_pressure(score)
        entity = SHOWN_CONTACTS if model == first else f"{CONTACTS}/others/{model}"
        for number, patch in enumerate(score.patches):
            _show_patch(stage, f"{entity}/jaw_{patch.jaw}_{number}", patch, highest)


def model_with_contacts(scores: dict[str, ScoreRecord]) -> str | None:
    """The model whose contacts the view shows first."""
    models = [model for model, score in scores.items() if score.patches]
    return PREFERRED if PREFERRED in models else next(iter(models), None)


def highest_pressure(score: ScoreRecord) -> float:
    """The scale's upper end [Pa]."""
    peaks = [float(p.pressures.max()) for p in score.patches if p.pressures.size]
    return max(peaks, default=0.0)


def _show_patch(stage: Stage, entity: str, patch: PatchRecord, highest: float) -> None:
    if len(patch.triangles_object):
        lifted = patch.triangles_object - PROUD * patch.normal_object
        shades = pressure_rgba(patch, highest)
        stage.static(f"{entity}/pressure", flat_mesh(lifted, None, shades))
    magnitude = float(np.linalg.norm(patch.force_object))
    vector = patch.force_object * FORCE_SCALE
    stage.static(
        f"{entity}/force",
        rr.Arrows3D(
            origins=[patch.center_object - vector],
            vectors=[vector],
            colors=[colors.FORCE],
            radii=[0.0011],
            labels=[f"{magnitude:.1f} N"],
        ),
    )


def pressure_rgba(patch: PatchRecord, highest: float) -> np.ndarray:
    """Colors of a patch's corners, shape (3 M, 4)."""
    rgb = colors.pressure_colors(patch.pressures, highest).reshape(-1, 3)
    return np.column_stack([rgb, np.full(len(rgb), 255, np.uint8)])
