"""One arm of ABB's YuMi (IRB 14000): its kinematic table and a body of primitive shapes.

The table is public knowledge of the arm; the shapes are ours, measured off nothing but the
table: a capsule from each joint to the next. They serve collision checks and pictures.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from math import pi, radians

import numpy as np

from collection.robots.description import Shape
from collection.robots.kinematics import SerialChain, from_table
from reach.arrays import FloatArray, frozen
from reach.gripper import ParallelJawGripper
from reach.transforms import make_transform, rotation_about

JOINT_NAMES = ("joint_1", "joint_2", "joint_7", "joint_3", "joint_4", "joint_5", "joint_6")
"""In kinematic order; the controller counts 1 to 6, with joint 7 as its external axis."""
CONTROLLER_ORDER = (0, 1, 3, 4, 5, 6, 2)
"""Where the controller's joints 1, 2, 3, 4, 5, 6, 7 stand in our order."""
LINK_RADII = (0.075, 0.06, 0.06, 0.05, 0.045, 0.04, 0.036)
TORSO_CENTER, TORSO_HALF = (-0.10, 0.0, 0.20), (0.12, 0.11, 0.20)

_FIRST_JOINT = {
    "right": ((0.05355, -0.0725, 0.41492), (-0.9795, -0.5682, -2.3155)),
    "left": ((0.05355, 0.0725, 0.41492), (0.9781, -0.5716, 2.3180)),
}
_FURTHER_JOINTS = [
    ((0.03, 0.0, 0.1), (pi / 2, 0.0, 0.0), -2.50455, 0.759218, 3.14159),
    ((-0.03, 0.17283, 0.0), (-pi / 2, 0.0, 0.0), -2.94088, 2.94088, 3.14159),
    ((-0.04188, 0.0, 0.07873), (pi / 2, -pi / 2, 0.0), -2.15548, 1.39626, 3.14159),
    ((0.0405, 0.16461, 0.0), (-pi / 2, 0.0, 0.0), -5.06145, 5.06145, 6.98132),
    ((-0.027, 0.0, 0.10039), (pi / 2, 0.0, 0.0), -1.53589, 2.40855, 6.98132),
    ((0.027, 0.029, 0.0), (-pi / 2, 0.0, 0.0), -3.99680, 3.99680, 6.98132),
]
_HOME_DEGREES = {
    "right": (0.0, -130.0, -135.0, 30.0, 0.0, 40.0, 0.0),
    "left": (0.0, -130.0, 135.0, 30.0, 0.0, 40.0, 0.0),
}
T_FLANGE_GRIPPER = make_transform(rotation_about((0, 0, 1), pi), (0.0, 0.0, 0.007))


@dataclass(frozen=True, slots=True, eq=False)
class YumiArm:
    """Kinematics and shape of one arm.

    Args:
        side: `right` or `left`.
        chain: joints in kinematic order; its tip is the gripper's frame.
        home: shape (7,) [rad].
        shapes: of the torso and the links; the gripper's solids are in `gripper_shapes`.
    """

    side: str
    chain: SerialChain
    home: FloatArray
    shapes: tuple[Shape, ...]


@cache
def yumi_arm(side: str = "right") -> YumiArm:
    """One of the two arms."""
    xyz, rpy = _FIRST_JOINT[side]
    rows = [(xyz, rpy, -2.94088, 2.94088, 3.14159), *_FURTHER_JOINTS]
    chain = from_table(rows, T_FLANGE_GRIPPER)
    home = frozen([radians(angle) for angle in _HOME_DEGREES[side]])
    return YumiArm(side, chain, home, _body_shapes(chain))


def link_name(number: int) -> str:
    """Name of the link that a joint moves, by the joint's place in kinematic order."""
    return "link_" + JOINT_NAMES[number].removeprefix("joint_")


def gripper_shapes(gripper: ParallelJawGripper, opening: float | None = None) -> tuple[Shape, ...]:
    """The hand's solids at an opening [m], as shapes of the link `gripper`."""
    return tuple(
        Shape("gripper", "box", tuple(box.half_extents), box.T_gripper_box, (0.3, 0.3, 0.33, 1.0))
        for box in gripper.boxes(opening)
    )


def _body_shapes(chain: SerialChain) -> tuple[Shape, ...]:
    shapes = [Shape("base", "box", TORSO_HALF, make_transform(None, TORSO_CENTER))]
    for number in range(len(chain)):
        following = (
            chain.T_parent_joint[number + 1] if number + 1 < len(chain) else chain.T_last_tip
        )
        shapes.append(_bone(link_name(number), following[:3, 3], LINK_RADII[number]))
    return tuple(shapes)


def _bone(link: str, end: FloatArray, radius: float) -> Shape:
    """A capsule from a link's origin to a point of it, shape (3,) [m]."""
    length = float(np.linalg.norm(end))
    axis = end / length
    across = np.cross(axis, np.eye(3)[int(np.argmin(np.abs(axis)))])
    across /= np.linalg.norm(across)
    rotation = np.column_stack([across, np.cross(axis, across), axis])
    return Shape(link, "capsule", (radius, 0.5 * length), make_transform(rotation, 0.5 * end))
