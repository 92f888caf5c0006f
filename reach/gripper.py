"""Parallel-jaw grippers: pads, stroke, force, and the solids that may collide."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from reach.arrays import FloatArray, frozen, frozen_finite, positive
from reach.errors import InvalidInputError, InvalidPadError
from reach.transforms import as_transform, make_transform


@dataclass(frozen=True, slots=True, eq=False)
class Pad:
    """A flat compliant jaw pad.

    In the pad's frame x is the approach direction (toward the finger tip) and z the closing
    direction; its face is the plane z = 0.

    Args:
        polygon: outline of the face, convex, counter-clockwise, shape (N, 2), pad x, y [m].
        thickness: of the soft layer [m].
        max_deformation: how deep the pad can be pressed at most [m].

    Raises:
        InvalidPadError: fewer than three corners, not convex, no area.
    """

    polygon: FloatArray
    thickness: float = 3e-3
    max_deformation: float = 5.3e-3

    def __post_init__(self) -> None:
        try:
            polygon = frozen_finite(self.polygon, "pad polygon", (-1, 2))
        except InvalidInputError as error:
            raise InvalidPadError(
                f"pad polygon is not planar, (N, 2) in meters: {error}"
            ) from error
        object.__setattr__(self, "polygon", _counter_clockwise_convex(polygon))
        object.__setattr__(self, "thickness", positive(self.thickness, "pad thickness [m]"))
        object.__setattr__(
            self, "max_deformation", positive(self.max_deformation, "pad max_deformation [m]")
        )

    @property
    def area(self) -> float:
        """Area of the face [m^2]."""
        x, y = self.polygon.T
        return 0.5 * float(np.dot(x, np.roll(y, -1)) - np.dot(y, np.roll(x, -1)))

    @property
    def width(self) -> float:
        """Extent across the approach direction (pad y) [m]."""
        return float(np.ptp(self.polygon[:, 1]))


@dataclass(frozen=True, slots=True, eq=False)
class Box:
    """A cuboid of the gripper's body: pose of its center in the gripper's frame, half extents [m]."""

    T_gripper_box: FloatArray
    half_extents: FloatArray

    def __post_init__(self) -> None:
        object.__setattr__(self, "T_gripper_box", as_transform(self.T_gripper_box, "T_gripper_box"))
        object.__setattr__(
            self, "half_extents", frozen_finite(self.half_extents, "half_extents", (3,))
        )


@dataclass(frozen=True, slots=True, eq=False)
class Jaw:
    """One jaw: its pad, where the pad is when fully open, and the finger's solids.

    The jaw travels along the pad's z axis. `boxes` are given at full opening and travel with it.
    """

    pad: Pad
    T_gripper_pad_open: FloatArray
    boxes: tuple[Box, ...] = ()

    def __post_init__(self) -> None:
        object.__setattr__(
            self, "T_gripper_pad_open", as_transform(self.T_gripper_pad_open, "T_gripper_pad_open")
        )


@dataclass(frozen=True, slots=True, eq=False)
class ParallelJawGripper:
    """A gripper whose jaws close along their pads' z axes, all by the same travel.

    Args:
        name: of the gripper.
        jaws: two for a parallel-jaw gripper; the contact models take any number.
        stroke: travel of each jaw from fully open to closed [m].
        max_force: closing force of a jaw [N].
        max_speed: closing speed of a jaw [m/s].
        palm: solids that do not move with the jaws.
    """

    name: str
    jaws: tuple[Jaw, ...]
    stroke: float
    max_force: float
    max_speed: float
    palm: tuple[Box, ...] = ()

    def __post_init__(self) -> None:
        if not self.jaws:
            raise InvalidInputError(f"gripper {self.name!r} has no jaws")
        for name in ("stroke", "max_force", "max_speed"):
            object.__setattr__(self, name, positive(getattr(self, name), f"gripper {name}"))

    @classmethod
    def yumi(cls) -> ParallelJawGripper:
        """The ABB YuMi SmartGripper with the laboratory's silicone pads ([Danielczuk2019] Sect. 5).

        The gripper's frame has its origin at the hand's base; z points at the finger tips.
        """
        outline_mm = [(-17.5, -10), (5, -10), (10, -5), (10, 5), (5, 10), (-17.5, 10)]
        pad = Pad(np.array(outline_mm) * 1e-3)
        z_pad = 0.160098
        T_pad0 = np.eye(4)
        T_pad0[:3, :3] = np.column_stack([(0, 0, 1), (0, -1, 0), (1, 0, 0)])
        T_pad0[:3, 3] = (-0.025, -0.000011, z_pad)
        T_pad1 = np.eye(4)
        T_pad1[:3, :3] = np.column_stack([(0, 0, 1), (0, 1, 0), (-1, 0, 0)])
        T_pad1[:3, 3] = (0.025, 0.000011, z_pad)
        palm = Box(make_transform(None, (0, 0, 0.046)), frozen((0.0415, 0.045, 0.046)))
        return cls(
            "yumi",
            (Jaw(pad, T_pad0, _finger(-1)), Jaw(pad, T_pad1, _finger(+1))),
            stroke=0.025,
            max_force=20.0,
            max_speed=0.020,
            palm=(palm,),
        )

    @property
    def max_opening(self) -> float:
        """Distance between the faces of two opposite pads, fully open [m]."""
        return 2.0 * self.stroke

    def T_gripper_pad(self, jaw: int, opening: float | None = None) -> FloatArray:
        """Pose of a pad's frame in the gripper's, at an opening [m] (fully open if None)."""
        T = np.array(self.jaws[jaw].T_gripper_pad_open)
        T[:3, 3] += T[:3, 2] * self.travel(opening)
        return T

    def travel(self, opening: float | None) -> float:
        """Travel of each jaw from fully open to an opening [m].

        Raises:
            InvalidInputError: if the opening is outside zero to the maximal one.
        """
        if opening is None:
            return 0.0
        if not 0.0 <= opening <= self.max_opening + 1e-9:
            raise InvalidInputError(
                f"opening {opening!r} m of gripper {self.name!r} is outside 0 to {self.max_opening} m"
            )
        return 0.5 * (self.max_opening - opening)

    def boxes(self, opening: float | None = None) -> tuple[Box, ...]:
        """All solids of palm and fingers at an opening [m], gripper frame."""
        travel = self.travel(opening)
        moved = [
            Box(
                _shifted(box.T_gripper_box, jaw.T_gripper_pad_open[:3, 2] * travel),
                box.half_extents,
            )
            for jaw in self.jaws
            for box in jaw.boxes
        ]
        return (*self.palm, *moved)


def _finger(side: int) -> tuple[Box, ...]:
    """Solids of a YuMi finger at full opening; its pad's face is at x = side * 25 mm."""
    tip = Box(make_transform(None, (side * 0.0305, 0, 0.1563)), frozen((0.0055, 0.010, 0.0138)))
    shank = Box(make_transform(None, (side * 0.0315, 0, 0.117)), frozen((0.0065, 0.010, 0.0255)))
    return (tip, shank)


def _shifted(T: FloatArray, offset: FloatArray) -> FloatArray:
    result = np.array(T)
    result[:3, 3] += offset
    return result


def _counter_clockwise_convex(polygon: FloatArray) -> FloatArray:
    if len(polygon) < 3:
        raise InvalidPadError(f"pad polygon has {len(polygon)} corners, expected at least 3")
    edges = np.roll(polygon, -1, axis=0) - polygon
    following = np.roll(edges, -1, axis=0)
    turns = edges[:, 0] * following[:, 1] - edges[:, 1] * following[:, 0]
    heading = np.arctan2(turns, np.einsum("ij,ij->i", edges, following)).sum()
    if np.any(turns > 0) and np.any(turns < 0):
        raise InvalidPadError(f"pad polygon is not convex: {polygon.tolist()}")
    if np.all(turns == 0) or not np.isclose(abs(heading), 2 * np.pi, atol=1e-6):
        raise InvalidPadError(
            f"pad polygon has no area or winds more than once: {polygon.tolist()}"
        )
    return polygon if heading > 0 else frozen(polygon[::-1])
