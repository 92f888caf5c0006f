"""What a robot is: limits and shape, for plans, pictures and records."""

from __future__ import annotations

from dataclasses import dataclass

from reach.arrays import FloatArray


@dataclass(frozen=True, slots=True, eq=False)
class Shape:
    """A primitive of the robot's body.

    Args:
        link: the link it moves with, a key of `Arm.link_transforms`.
        kind: `box`, `cylinder` (along z) or `capsule` (along z).
        size: box: half extents (x, y, z); cylinder, capsule: (radius, half length) [m].
        T_link_shape: pose of its center, shape (4, 4).
        rgba: color, each in [0, 1].
    """

    link: str
    kind: str
    size: tuple[float, ...]
    T_link_shape: FloatArray
    rgba: tuple[float, float, float, float] = (0.85, 0.85, 0.87, 1.0)


@dataclass(frozen=True, slots=True, eq=False)
class RobotDescription:
    """The robot as pictures and records need it.

    Args:
        name: of the robot.
        joint_names: in the order of every joint vector.
        lower: joint limits, shape (J,) [rad].
        upper: joint limits, shape (J,) [rad].
        max_speed: of the joints, shape (J,) [rad/s].
        home: shape (J,) [rad].
        shapes: primitives of all links.
        mjcf: the same as a MuJoCo model, to attach to a record.
    """

    name: str
    joint_names: tuple[str, ...]
    lower: FloatArray
    upper: FloatArray
    max_speed: FloatArray
    home: FloatArray
    shapes: tuple[Shape, ...]
    mjcf: str
