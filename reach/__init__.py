"""The vocabulary of grasping, the contact models and what they need; no hardware, no files.

Names are imported when first used, because numba and trimesh each take about a second to load.
"""

from __future__ import annotations

import importlib
import sys
from types import ModuleType
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from reach.errors import ReachError
    from reach.grasp import Grasp
    from reach.gripper import Pad, ParallelJawGripper
    from reach.models.area import AreaContact
    from reach.models.ellipse import EllipseContact
    from reach.models.point import PointContact
    from reach.models.settled import SettledContact
    from reach.objects import GraspObject
    from reach.pose_error import PoseError
    from reach.reliability import reliability
    from reach.scene import Scene

_HOME = {
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
    "reliability": "reach.reliability",
}

__all__ = [
    "AreaContact",
    "EllipseContact",
    "Grasp",
    "GraspObject",
    "Pad",
    "ParallelJawGripper",
    "PointContact",
    "PoseError",
    "ReachError",
    "Scene",
    "SettledContact",
    "reliability",
]


class _Package(ModuleType):
    """Keeps `reach.reliability` the function when the module of the same name is imported."""

    def __setattr__(self, name: str, value: Any) -> None:
        if name == "reliability" and isinstance(value, ModuleType):
            value = value.reliability
        super().__setattr__(name, value)


sys.modules[__name__].__class__ = _Package


def __getattr__(name: str) -> Any:
    if name not in _HOME:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(importlib.import_module(_HOME[name]), name)
