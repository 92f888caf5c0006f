"""Name the directions in which the image leaves the pose open."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from reach.arrays import FloatArray
from reach.transforms import make_transform, rotation_about, skew

OPEN = 3e-3
"""A direction is open if its standard deviation moves the part's rim by more than this [m]."""
_AXES = ("x", "y", "z")
CONFIDENCE = 2.33
"""Standard deviations within which 98 % of a direction's errors lie."""
STEPS = (1.0, 1.5, 2.0, 3.0)
"""An open direction is followed so many times as far as what is known well enough: further off it
is another pose no less, and the covariance no longer holds."""


@dataclass(frozen=True, slots=True, eq=False)
class OpenWay:
    """One way along which the pose may be further off than is known well enough.

    Args:
        poses: ever further along it, shape (K, 4, 4).
    """

    poses: FloatArray


def open_ways(
    T: FloatArray, covariance: FloatArray, com: FloatArray, max_turn: float, max_shift: float
) -> tuple[OpenWay, ...]:
    """Both ways along each principal direction that the covariance leaves open.

    A pose that is known to within the limits has none. Along a direction that is known less well,
    the poses begin at the limit and end where the pose would be if its error there were as large
    as it may well be, with the other directions following as the covariance says.

    Args:
        T: pose, shape (4, 4).
        covariance: of (rotation, translation), right perturbation, object frame, shape (6, 6).
        com: the part's center of mass, shape (3,), object frame [m].
        max_turn: rotation that is known well enough [rad].
        max_shift: shift of the center of mass that is known well enough [m].
    """
    to_com = np.eye(6)
    to_com[3:, :3] = -skew(com)
    about_com = to_com @ covariance @ to_com.T
    ways = []
    for part, limit in ((slice(0, 3), max_turn), (slice(3, 6), max_shift)):
        values, vectors = np.linalg.eigh(about_com[part, part])
        for value, vector in zip(values, vectors.T, strict=True):
            reach = CONFIDENCE * np.sqrt(value)
            if reach <= limit:
                continue
            unit = about_com[:, part] @ vector / value
            lengths = [step * limit for step in STEPS if step * limit < reach]
            lengths = (lengths + [reach])[: len(STEPS)]
            ways += [
                OpenWay(np.stack([T @ _moved(sign * way * unit, com) for way in lengths]))
                for sign in (1, -1)
            ]
    return tuple(ways)


def _moved(step: FloatArray, com: FloatArray) -> FloatArray:
    """A turn about, and a shift of, the center of mass (6,) as a transform (4, 4)."""
    angle = float(np.linalg.norm(step[:3]))
    R = rotation_about(step[:3], angle) if angle > 0 else np.eye(3)
    return make_transform(R, com - R @ com + step[3:])


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
    about_com[3:, :3] = skew(com)
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
