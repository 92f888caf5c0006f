"""Candidate grasps: antipodal by ray shooting, free of collision, jittered, no duplicates.

Names are imported when first used: a plan's records need the options, but no compiled kernel.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collection.sampling.options import SamplingOptions
    from collection.sampling.sampler import Reachable, SampledGrasp, SampleResult, sample_grasps

_HOME = {
    "Reachable": "collection.sampling.sampler",
    "SampleResult": "collection.sampling.sampler",
    "SampledGrasp": "collection.sampling.sampler",
    "SamplingOptions": "collection.sampling.options",
    "sample_grasps": "collection.sampling.sampler",
}

__all__ = ["Reachable", "SampleResult", "SampledGrasp", "SamplingOptions", "sample_grasps"]


def __getattr__(name: str) -> Any:
    if name not in _HOME:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(importlib.import_module(_HOME[name]), name)
