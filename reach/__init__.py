"""The vocabulary of grasping, the contact models and what they need; no hardware, no files.

Names are imported when first used, because numba and trimesh each take about a second to load.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from reach.errors import ReachError
    from reach.grasp import Grasp
    from reach.gripper import Pad, ParallelJawGripper
    from reach.objects import GraspObject
    from reach.scene import Scene

_HOME = {
    "Grasp": "reach.grasp",
    "GraspObject": "reach.objects",
    "Pad": "reach.gripper",
    "ParallelJawGripper": "reach.gripper",
    "ReachError": "reach.errors",
    "Scene": "reach.scene",
}

__all__ = ["Grasp", "GraspObject", "Pad", "ParallelJawGripper", "ReachError", "Scene"]


def __getattr__(name: str) -> Any:
    if name not in _HOME:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(importlib.import_module(_HOME[name]), name)
