"""How fast a motion is, in the controller's terms.

The controller limits the speed of tool0; a [Speed][collection.robots.protocol.Speed] limits the
joints, too. The slower counts, so the tool's speed is lowered until the joints keep theirs.
"""

from __future__ import annotations

import numpy as np

from collection.robots.protocol import Speed
from reach.arrays import FloatArray
from reach.transforms import rotation_angle

SLOWEST_MM, SLOWEST_DEG = 1.0, 1.0
"""What the controller is asked for at least [mm/s], [deg/s]."""


def motion_time(
    T_start: FloatArray,
    T_end: FloatArray,
    turn: FloatArray,
    max_speed: FloatArray,
    speed: Speed,
) -> tuple[float, float]:
    """Time of a motion by the tool's limits and by the joints' [s]; the longer counts.

    Args:
        T_start: gripper pose at the start, shape (4, 4).
        T_end: at the end.
        turn: of each joint, shape (J,) [rad].
        max_speed: of the joints, shape (J,) [rad/s].
        speed: the limits.
    """
    way = float(np.linalg.norm(T_end[:3, 3] - T_start[:3, 3]))
    angle = rotation_angle(T_start[:3, :3].T @ T_end[:3, :3])
    by_tool = max(way / speed.linear, angle / speed.angular)
    by_joints = float(np.max(np.abs(turn) / (speed.joint * max_speed)))
    return by_tool, by_joints


def request_speeds(
    T_start: FloatArray,
    T_end: FloatArray,
    turn: FloatArray,
    max_speed: FloatArray,
    speed: Speed,
) -> tuple[float, float]:
    """Tool speed [mm/s] and turning speed [deg/s] that keep all limits; arguments as above."""
    by_tool, by_joints = motion_time(T_start, T_end, turn, max_speed, speed)
    share = 1.0 if by_joints <= by_tool else by_tool / by_joints
    return (
        max(SLOWEST_MM, 1000 * speed.linear * share),
        max(SLOWEST_DEG, float(np.degrees(speed.angular)) * share),
    )
