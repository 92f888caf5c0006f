"""From where the views look: anchors that each recording places, so that one layout suits all.

In an anchor's frame the hand closes along x, and its fingers reach in from beyond: an eye on
the side of negative y sees both pads and what is between them.
"""

from __future__ import annotations

import numpy as np
import rerun as rr

from logs.record.trial_record import TrialRecord
from logs.view.object import OBJECT, WORLD, believed_pose, object_triangles
from logs.view.stage import Stage
from reach.arrays import FloatArray
from reach.grasp import Grasp

SCENE_ANCHOR = f"{WORLD}/eye"
"""The scene is looked at from here: where the object was found, upright."""
CONTACT_ANCHOR = f"{OBJECT}/eye"
"""Contacts are looked at from here: the hand's axes, scaled to the object's size."""
UNIT_DIAMETER = 0.052
"""Diagonal that every object seems to have in the contacts' anchor [m]."""
DEFAULT_DIAMETER = 0.05


def show_anchors(stage: Stage, record: TrialRecord) -> None:
    """Place the anchors of a trial."""
    T_world_object, grasp = believed_pose(record), tried_grasp(record)
    turn = turned_to_hand(T_world_object @ grasp.T_object_gripper, _arm_side(record))
    stage.static(SCENE_ANCHOR, rr.Transform3D(translation=T_world_object[:3, 3], mat3x3=turn.T))
    upright = grasp.T_object_gripper[:3, :3] * (1, -1, -1)  # the fingers point down
    triangles = object_triangles(record)
    middle = np.zeros(3) if triangles is None else 0.5 * _bounds(triangles).sum(axis=0)
    scale = object_diameter(record) / UNIT_DIAMETER
    stage.static(CONTACT_ANCHOR, rr.Transform3D(translation=middle, mat3x3=upright * scale))


def tried_grasp(record: TrialRecord) -> Grasp:
    """The grasp as it was executed, or as it was planned if it was not."""
    return record.execution.executed if record.execution else record.descriptor.planned


def object_diameter(record: TrialRecord) -> float:
    """Diagonal of the object's bounding box [m]; a plausible one if no mesh is attached."""
    triangles = object_triangles(record)
    if triangles is None:
        return DEFAULT_DIAMETER
    return float(np.linalg.norm(np.ptp(_bounds(triangles), axis=0)))


def turned_to_hand(T_world_gripper: FloatArray, arm: FloatArray | None = None) -> FloatArray:
    """Rotation about the vertical after which the hand closes along x and stands beyond, at +y.

    Args:
        T_world_gripper: shape (4, 4).
        arm: horizontal unit vector from the object to the robot's body, shape (2,): rather
            look toward the body than along the arm.

    Returns:
        R_anchor_world, shape (3, 3).
    """
    closing, approach = T_world_gripper[:2, [0, 2]].T
    length = np.hypot(*closing)
    c, s = closing / length if length > 0 else (1.0, 0.0)
    beyond = -approach + (0.5 * arm if arm is not None else 0.0)
    if c * beyond[1] - s * beyond[0] < 0:
        c, s = -c, -s
    return np.array([(c, s, 0.0), (-s, c, 0.0), (0.0, 0.0, 1.0)])


def _arm_side(record: TrialRecord) -> FloatArray | None:
    """Where the robot's links were at first, seen from the object."""
    starts = [track.translations[0, :2] for track in record.frames.values() if len(track.time_ns)]
    if not starts:
        return None
    away: FloatArray = np.mean(starts, axis=0) - believed_pose(record)[:2, 3]
    length = np.linalg.norm(away)
    return away / length if length > 0 else None


def _bounds(triangles: FloatArray) -> FloatArray:
    """Lowest and highest corner, shape (2, 3)."""
    return np.stack([triangles.min(axis=(0, 1)), triangles.max(axis=(0, 1))])
