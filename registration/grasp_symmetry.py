"""Are two grasps the same grasp of a symmetric part?"""

from __future__ import annotations

import numpy as np

from reach.arrays import FloatArray
from reach.symmetry import Symmetry
from reach.transforms import rotation_about

ANGLES = 720
"""Turns about an axis of revolution that are tried."""


def same_grasp(
    sym: Symmetry, T_a: FloatArray, T_b: FloatArray, max_turn: float, max_shift: float
) -> bool:
    """Whether some symmetry of the part takes one grasp to the other, within tolerances.

    Args:
        sym: of the part.
        T_a: pose of the gripper in the object's frame, shape (4, 4).
        T_b: pose of the gripper in the object's frame, shape (4, 4).
        max_turn: largest rotation between them [rad].
        max_shift: largest distance between the grippers' origins [m].
    """
    copies = _rotations(sym, T_a, T_b)
    turned = copies @ T_a[:3, :3]
    at = sym.center + copies @ (T_a[:3, 3] - sym.center)
    cosine = ((turned * T_b[:3, :3]).sum(axis=(1, 2)) - 1.0) / 2.0
    turn = np.arccos(np.clip(cosine, -1.0, 1.0))
    shift = np.linalg.norm(at - T_b[:3, 3], axis=1)
    return bool(np.any((turn <= max_turn) & (shift <= max_shift)))


def _rotations(sym: Symmetry, T_a: FloatArray, T_b: FloatArray) -> FloatArray:
    """Rotations (K, 3, 3) of the part onto itself that could take one grasp to the other."""
    if sym.sphere:
        return np.asarray((T_b[:3, :3] @ T_a[:3, :3].T)[None])
    if sym.axis is None:
        return sym.rotations
    turns = np.array(
        [rotation_about(sym.axis, angle) for angle in np.arange(ANGLES) * 2 * np.pi / ANGLES]
    )
    return np.concatenate([turns @ rotation for rotation in sym.rotations])
