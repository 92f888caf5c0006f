"""A planned or executed grasp."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from reach.arrays import FloatArray, positive
from reach.transforms import as_transform

DEFAULT_CLOSING_FORCE = 20.0
"""Closing force of the laboratory's trials [N]."""


@dataclass(frozen=True, slots=True, eq=False)
class Grasp:
    """Where the gripper stands on the object when its jaws close.

    Args:
        T_object_gripper: pose of the gripper in the object's frame, shape (4, 4).
        opening: distance of the pads before closing [m]; fully open if None.
        force: closing force of each jaw [N].

    Raises:
        InvalidTransformError: T_object_gripper is not rigid.
        InvalidInputError: opening or force not finite and positive.
    """

    T_object_gripper: FloatArray
    opening: float | None = None
    force: float = DEFAULT_CLOSING_FORCE

    def __post_init__(self) -> None:
        object.__setattr__(
            self, "T_object_gripper", as_transform(self.T_object_gripper, "T_object_gripper")
        )
        object.__setattr__(self, "force", positive(self.force, "closing force [N]"))
        if self.opening is not None:
            object.__setattr__(self, "opening", positive(self.opening, "opening [m]"))

    def __eq__(self, other: object) -> bool:
        return (
            isinstance(other, Grasp)
            and np.array_equal(self.T_object_gripper, other.T_object_gripper)
            and self.opening == other.opening
            and self.force == other.force
        )

    def __hash__(self) -> int:
        return hash((self.T_object_gripper.tobytes(), self.opening, self.force))
