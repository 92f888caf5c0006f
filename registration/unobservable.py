"""Name the directions in which the image leaves the pose open."""

from __future__ import annotations

import numpy as np

from reach.arrays import FloatArray

OPEN = 3e-3
"""A direction is open if its standard deviation moves the part's rim by more than this [m]."""
_AXES = ("x", "y", "z")


def unobservable_directions(
    information: FloatArray, com: FloatArray, radius: float
) -> tuple[str, ...]:
    """Directions that the observed points alone do not fix, in words, weakest first.

    Args:
        information: of (rotation, translation), right perturbation, object frame, shape (6, 6).
        com: the part's center of mass, shape (3,), object frame [m].
        radius: of the part about it [m].
    """
    about_com = np.eye(6)
    about_com[3:, :3] = np.array(
        [[0.0, -com[2], com[1]], [com[2], 0.0, -com[0]], [-com[1], com[0], 0.0]]
    )
    # Turns count by how far they move the rim, so that both kinds of direction are in meters.
    scale = np.diag([1 / radius] * 3 + [1.0] * 3)
    scaled = scale @ about_com.T @ information @ about_com @ scale
    values, vectors = np.linalg.eigh(0.5 * (scaled + scaled.T))
    names = []
    for value, vector in zip(values, vectors.T, strict=True):
        if value > OPEN**-2.0:
            break
        names.append(_name(vector))
    return tuple(names)


def _name(direction: FloatArray) -> str:
    turn, shift = direction[:3], direction[3:]
    turning = bool(np.linalg.norm(turn) >= np.linalg.norm(shift))
    axis = turn if turning else shift
    axis = axis / np.linalg.norm(axis)
    axis = axis * np.sign(axis[np.argmax(np.abs(axis))])
    what = "rotation about" if turning else "translation along"
    main = int(np.argmax(np.abs(axis)))
    if abs(axis[main]) > np.cos(np.radians(10)):
        return f"{what} the object's {_AXES[main]}"
    return f"{what} the object's ({axis[0]:.2f}, {axis[1]:.2f}, {axis[2]:.2f})"
