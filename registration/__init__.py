"""A known mesh and an organized depth image in, a pose with covariance out.

Names are imported when first used: Open3D and numba take seconds to load.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from registration.errors import RegistrationError
    from registration.frame import DepthFrame, Intrinsics
    from registration.options import RegistrationOptions, SensorProfile
    from registration.pipeline import register
    from registration.result import Registration, Rival

_HOME = {
    "DepthFrame": "registration.frame",
    "Intrinsics": "registration.frame",
    "Registration": "registration.result",
    "RegistrationError": "registration.errors",
    "RegistrationOptions": "registration.options",
    "Rival": "registration.result",
    "SensorProfile": "registration.options",
    "register": "registration.pipeline",
}

__all__ = [
    "DepthFrame",
    "Intrinsics",
    "Registration",
    "RegistrationError",
    "RegistrationOptions",
    "Rival",
    "SensorProfile",
    "register",
]


def __getattr__(name: str) -> Any:
    if name not in _HOME:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(importlib.import_module(_HOME[name]), name)
