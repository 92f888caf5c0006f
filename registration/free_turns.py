"""Turns that a part's symmetry leaves free: no image tells them, whatever its noise or facets say."""

from __future__ import annotations

import numpy as np

from reach.arrays import FloatArray
from reach.symmetry import Symmetry


def told_directions(sym: Symmetry) -> FloatArray:
    """Projection (6, 6) of (rotation, translation) that takes out turns about an axis of symmetry.

    A facet, or noise, seems to tell how a round part is turned about its axis. With P the
    projection, P^T information P tells nothing of it, and all else as before: errors P xi have
    no turn about the axis, and the center of mass stays where xi moves it. Right perturbation,
    object frame.

    Args:
        sym: of the part.
    """
    projection = np.eye(6)
    for axis in _axes(sym):
        turn = np.concatenate([axis, np.cross(sym.center, axis)])
        projection -= np.outer(turn, np.concatenate([axis, np.zeros(3)]))
    return projection


def _axes(sym: Symmetry) -> FloatArray:
    if sym.sphere:
        return np.eye(3)
    return np.zeros((0, 3)) if sym.axis is None else sym.axis[None]
