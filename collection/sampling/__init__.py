"""Candidate grasps: antipodal by ray shooting, free of collision, jittered, no duplicates."""

from __future__ import annotations

from collection.sampling.options import SamplingOptions
from collection.sampling.sampler import Reachable, SampledGrasp, SampleResult, sample_grasps

__all__ = ["Reachable", "SampleResult", "SampledGrasp", "SamplingOptions", "sample_grasps"]
