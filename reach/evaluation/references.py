"""The three rows every comparison needs, scores that use no contact model.

A model that does not beat `constant` says nothing, and one that does not beat `overlap` has no use
for its physics. `oracle` knows each grasp's success rate: on the same trials no score has a smaller
MAE or Brier score. It bounds nothing else. AR grows with every score that is raised, whatever the
labels: `constant` has 1, and F1 follows AR. AP at its rates is as good as ranks get but for grasps
of equal rate, which it does not tell apart, and for unequal numbers of trials.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from reach.evaluation.cases import GraspCase
from reach.evaluation.overlap import overlap_score
from reach.evaluation.scored import Parameter, ScoredModel
from reach.grasp import Grasp
from reach.scene import Scene

if TYPE_CHECKING:
    from reach.pose_error import PoseError

REFERENCE_NAMES = ("constant", "overlap", "oracle")
EXACT: Mapping[str, tuple[str, ...]] = {"constant": ("ar",), "oracle": ("mae",)}
"""Metrics whose value follows from a row's definition, whatever the labels."""


@dataclass(frozen=True, slots=True)
class ReferenceScore:
    """A score and nothing behind it."""

    value: float


@dataclass(frozen=True, slots=True)
class OverlapScorer:
    """Scores by the share of the pads that touches the object, over perturbed poses.

    Args:
        samples: number of perturbed poses.
    """

    samples: int = 30

    @property
    def name(self) -> str:
        """`overlap`."""
        return "overlap"

    @property
    def version(self) -> str:
        """Of the scores."""
        return "1"

    @property
    def parameters(self) -> dict[str, Parameter]:
        """What the scores depend on."""
        return {"samples": float(self.samples)}

    def score(
        self, scene: Scene, grasp: Grasp, *, pose_error: PoseError | None = None, seed: int = 0
    ) -> ReferenceScore:
        """Score one grasp."""
        value = overlap_score(scene, grasp, pose_error=pose_error, samples=self.samples, seed=seed)
        return ReferenceScore(value)


def constant_row(cases: Sequence[GraspCase]) -> ScoredModel:
    """Every grasp will succeed."""
    return ScoredModel("constant", "1", {"value": 1.0}, np.ones(len(cases)), 0.0)


def oracle_row(cases: Sequence[GraspCase]) -> ScoredModel:
    """Every grasp scored with the success rate of its own trials."""
    return ScoredModel("oracle", "1", {}, np.array([case.rate for case in cases]), 0.0)
