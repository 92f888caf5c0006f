"""The vocabulary of grasping, the contact models and what they need; no hardware, no files.

Names are imported when first used, because numba and trimesh each take about a second to load.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from reach.errors import ReachError as ReachError
    from reach.grasp import Grasp as Grasp
    from reach.gripper import Pad as Pad
    from reach.gripper import ParallelJawGripper as ParallelJawGripper
    from reach.models.area import AreaContact as AreaContact
    from reach.models.ellipse import EllipseContact as EllipseContact
    from reach.models.point import PointContact as PointContact
    from reach.models.settled import SettledContact as SettledContact
    from reach.objects import GraspObject as GraspObject
    from reach.pose_error import PoseError as PoseError
    from reach.robustness import reliability as reliability
    from reach.scene import Scene as Scene

_HOME = {  # the module of every public name, as above
    "AreaContact": "reach.models.area",
    "EllipseContact": "reach.models.ellipse",
    "Grasp": "reach.grasp",
    "GraspObject": "reach.objects",
    "Pad": "reach.gripper",
    "ParallelJawGripper": "reach.gripper",
    "PointContact": "reach.models.point",
    "PoseError": "reach.pose_error",
    "ReachError": "reach.errors",
    "Scene": "reach.scene",
    "SettledContact": "reach.models.settled",
    "reliability": "reach.robustness",
}

__all__ = [*_HOME]


def __getattr__(name: str) -> Any:
    if name not in _HOME:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(importlib.import_module(_HOME[name]), name)
