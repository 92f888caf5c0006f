"""The verdict of a person who sees everything: the simulated cell's ground truth.

"Stably lifted" is one written rule everywhere: clear of the table by 50 mm and still held after
one second; turning in the grasp counts as success, flagged `rotated`.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from reach.arrays import FloatArray
from reach.transforms import inverse, rotation_angle
from reach.world.grasp_world import GraspWorld

CLEARANCE = 0.050
"""Lowest point above the table of a lifted object [m]."""
HELD_TIME = 1.0
"""How long it must stay so [s]."""
ROTATED_ANGLE = np.radians(10.0)
"""Turned in the grasp by more than this is `rotated` [rad]."""
RISEN = 5e-4
"""A hand this far above its lowest point has begun to lift [m]."""
LOWERING = 0.030
"""A hand this far below its highest point is putting the object down [m]."""


@dataclass(frozen=True, slots=True)
class SimulatedVerdict:
    """What happened to the object.

    Args:
        lifted: clear of the table by 50 mm, and still held after 1 s and when put down.
        rotated: it turned in the grasp while it was lifted.
        held_seconds: for how long it was clear, up to the moment it was put down [s].
        highest: greatest clearance seen [m].
        turned: angle it turned in the grasp [rad].
    """

    lifted: bool
    rotated: bool
    held_seconds: float
    highest: float
    turned: float


@dataclass(frozen=True, slots=True, eq=False)
class _Sight:
    time_ns: int
    hand_height: float
    clearance: float
    T_gripper_object: FloatArray


class Watcher:
    """Looks at the object whenever time passes while the jaws are closed."""

    def __init__(self, world: GraspWorld) -> None:
        self._world = world
        self._sights: list[_Sight] = []

    def look(self, time_ns: int, *, holding: bool) -> None:
        """Remember where the object is now, if the jaws are pressed together."""
        if not holding:
            return
        T_world_gripper = self._world.T_world_gripper
        self._sights.append(
            _Sight(
                time_ns,
                float(T_world_gripper[2, 3]),
                self._world.clearance,
                inverse(T_world_gripper) @ self._world.T_world_object,
            )
        )

    def verdict(self) -> SimulatedVerdict:
        """The verdict on all that was seen."""
        if not self._sights:
            return SimulatedVerdict(False, False, 0.0, 0.0, 0.0)
        raised = self._before_lowering()
        held = _seconds_clear_at_the_end(raised)
        highest = max(sight.clearance for sight in self._sights)
        lifted = held >= HELD_TIME
        turned = self._turned(raised) if lifted else 0.0
        return SimulatedVerdict(lifted, bool(turned > ROTATED_ANGLE), held, highest, turned)

    def _before_lowering(self) -> list[_Sight]:
        """What was seen until the hand left its highest place for good."""
        top = max(sight.hand_height for sight in self._sights)
        last = max(n for n, sight in enumerate(self._sights) if sight.hand_height >= top - LOWERING)
        return self._sights[: last + 1]

    def _turned(self, raised: list[_Sight]) -> float:
        """Angle in the grasp between the last sight before the hand rose, and the end."""
        bottom = min(sight.hand_height for sight in raised)
        start = [sight for sight in raised if sight.hand_height < bottom + RISEN][-1]
        relative = inverse(start.T_gripper_object) @ raised[-1].T_gripper_object
        return rotation_angle(relative[:3, :3])


def _seconds_clear_at_the_end(sights: list[_Sight]) -> float:
    """For how long the object had been clear of the table at the last sight [s]."""
    since = sights[-1].time_ns
    for sight in reversed(sights):
        if sight.clearance < CLEARANCE:
            break
        since = sight.time_ns
    return (sights[-1].time_ns - since) * 1e-9
