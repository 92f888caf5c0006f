"""Predicted contacts: patches colored by pressure, and each pad's force."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import rerun as rr

from logs.record.annotations import PatchRecord, ScoreRecord
from logs.view import colors
from logs.view.object import OBJECT
from logs.view.stage import Stage, flat_mesh
from reach.models.names import PATCH_MODEL

CONTACTS = f"{OBJECT}/contacts"
SHOWN_CONTACTS = f"{CONTACTS}/shown"
"""Contacts of the model that the view shows first."""
PROUD = 2e-4
"""Patches stand off the surface by this, so that they are not drawn inside it [m]."""
ARROW_LENGTH = 0.02
"""Length of a force arrow in diameters of the object [1/N]."""
ARROW_RADIUS = 0.012
"""Of a force arrow, in diameters of the object."""
BRIGHT_SHARE = 95
"""Percentile of the pressures from which on all is yellow."""


def show_contacts(stage: Stage, scores: dict[str, ScoreRecord], diameter: float) -> None:
    """Draw the contacts that each model predicts, in the object's frame.

    Args:
        stage: where.
        scores: newest score of each model.
        diameter: of the object [m].
    """
    first = model_with_contacts(scores)
    for model, score in scores.items():
        highest = brightest_pressure(score)
        entity = SHOWN_CONTACTS if model == first else f"{CONTACTS}/others/{model}"
        for number, patch in enumerate(score.patches):
            _show_patch(stage, f"{entity}/jaw_{patch.jaw}_{number}", patch, highest, diameter)


def model_with_contacts(scores: dict[str, ScoreRecord]) -> str | None:
    """The model whose contacts the view shows first."""
    models = [model for model, score in scores.items() if score.patches]
    return PATCH_MODEL if PATCH_MODEL in models else next(iter(models), None)


def highest_pressure(score: ScoreRecord) -> float:
    """Peak of all patches [Pa]."""
    peaks = [float(p.pressures.max()) for p in score.patches if p.pressures.size]
    return max(peaks, default=0.0)


def brightest_pressure(score: ScoreRecord) -> float:
    """The color scale's upper end [Pa]: a single sharp edge shall not darken all the rest."""
    known = [patch.pressures.ravel() for patch in score.patches if patch.pressures.size]
    return float(np.percentile(np.concatenate(known), BRIGHT_SHARE)) if known else 0.0


def _show_patch(
    stage: Stage, entity: str, patch: PatchRecord, highest: float, diameter: float
) -> None:
    if len(patch.triangles_object):
        lifted = patch.triangles_object - PROUD * patch.normal_object
        shades = pressure_rgba(patch, highest)
        stage.static(f"{entity}/pressure", flat_mesh(lifted, None, shades))
    label = f"{np.linalg.norm(patch.force_object):.1f} N"
    stage.static(f"{entity}/force", force_arrows([patch], diameter, labels=[label]))


def force_arrows(
    patches: Sequence[PatchRecord], diameter: float, labels: Sequence[str] | None = None
) -> rr.Arrows3D:
    """Arrows that end at the patches, as long as the forces are large beside the object.

    Args:
        patches: where the forces act.
        diameter: of the object [m].
        labels: of the arrows.
    """
    vectors = np.array([p.force_object for p in patches]).reshape(-1, 3) * ARROW_LENGTH * diameter
    ends = np.array([p.center_object for p in patches]).reshape(-1, 3)
    return rr.Arrows3D(
        origins=ends - vectors,
        vectors=vectors,
        colors=[colors.FORCE],
        radii=[ARROW_RADIUS * diameter],
        labels=labels,
    )


def pressure_rgba(patch: PatchRecord, highest: float) -> np.ndarray:
    """Colors of a patch's corners, shape (3 M, 4)."""
    rgb = colors.pressure_colors(patch.pressures, highest).reshape(-1, 3)
    return np.column_stack([rgb, np.full(len(rgb), 255, np.uint8)])
