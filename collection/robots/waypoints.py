"""Where the trial motion leads: avoidance, approach, grasp, lift, shake."""

from __future__ import annotations

import numpy as np

from collection.robots.motion_settings import MotionSettings
from collection.robots.protocol import Path, Waypoint
from reach.arrays import FloatArray, frozen
from reach.gripper import ParallelJawGripper
from reach.transforms import make_transform, rotation_about

PUT_DOWN_SHORT = 0.002
"""The hand stops this far above the grasp, so that the part is not pressed into the table [m]."""


def trial_waypoints(T_world_gripper: FloatArray, settings: MotionSettings) -> list[Waypoint]:
    """The way to the grasp, up, down again and away, for dry run and execution.

    Args:
        T_world_gripper: the grasp, shape (4, 4).
        settings: distances.
    """
    approach = approach_pose(T_world_gripper, settings)
    return [
        Waypoint("avoidance", avoidance_pose(approach, settings), Path.JOINT),
        Waypoint("approach", approach, Path.LINEAR),
        Waypoint("grasp", frozen(T_world_gripper), Path.LINEAR),
        Waypoint("lift", lift_pose(T_world_gripper, settings), Path.LINEAR),
        Waypoint("put down", put_down_pose(T_world_gripper), Path.LINEAR),
        Waypoint("retreat", approach, Path.LINEAR),
        Waypoint("leave", avoidance_pose(approach, settings), Path.LINEAR),
    ]


def approach_pose(T_world_gripper: FloatArray, settings: MotionSettings) -> FloatArray:
    """Back along the approach axis, shape (4, 4)."""
    return frozen(T_world_gripper @ make_transform(None, (0, 0, -settings.approach_distance)))


def avoidance_pose(T_world_approach: FloatArray, settings: MotionSettings) -> FloatArray:
    """Straight above the approach pose, high enough to pass over the part, shape (4, 4)."""
    T = np.array(T_world_approach)
    T[2, 3] = max(T[2, 3], settings.avoidance_height)
    return frozen(T)


def lift_pose(T_world_gripper: FloatArray, settings: MotionSettings) -> FloatArray:
    """Straight up from the grasp, shape (4, 4)."""
    return frozen(make_transform(None, (0, 0, settings.lift_height)) @ T_world_gripper)


def put_down_pose(T_world_gripper: FloatArray) -> FloatArray:
    """Where a held part is let go: barely above the grasp, shape (4, 4)."""
    return frozen(make_transform(None, (0, 0, PUT_DOWN_SHORT)) @ T_world_gripper)


def shake_poses(
    T_world_gripper: FloatArray, gripper: ParallelJawGripper, settings: MotionSettings
) -> list[FloatArray]:
    """Poses between which the lifted part is shaken, the first and last the given one.

    The hand turns about a horizontal axis that lies `shake_radius` behind the pads, across the
    approach direction; it is the gripper's y axis.
    """
    pads_z = float(np.mean([jaw.T_gripper_pad_open[2, 3] for jaw in gripper.jaws]))
    pivot = np.array([0.0, 0.0, pads_z - settings.shake_radius])
    poses = []
    for side in (1.0, -1.0) * settings.shake_cycles:
        turn = rotation_about((0, 1, 0), side * settings.shake_angle)
        poses.append(frozen(T_world_gripper @ make_transform(turn, pivot - turn @ pivot)))
    return [*poses, frozen(T_world_gripper)]
