"""One object on a table, and the gripper that shall lift it."""

from __future__ import annotations

from dataclasses import dataclass

from reach.arrays import FloatArray, frozen
from reach.gripper import ParallelJawGripper
from reach.objects import GraspObject
from reach.transforms import as_transform

GRAVITY = frozen((0.0, 0.0, -9.81))
"""Gravitational acceleration, world frame [m/s^2]."""


@dataclass(frozen=True, slots=True, eq=False)
class Scene:
    """What a contact model needs to know of the world besides the grasp.

    Args:
        object: the part.
        gripper: the hand.
        T_world_object: pose of the part before the lift; world z is up, shape (4, 4).
        table_height: world z of the table [m].
    """

    object: GraspObject
    gripper: ParallelJawGripper
    T_world_object: FloatArray
    table_height: float = 0.0

    def __post_init__(self) -> None:
        object.__setattr__(
            self, "T_world_object", as_transform(self.T_world_object, "T_world_object")
        )
