"""Scorers of the settled model: nominal, and graded over what is not known exactly."""

from __future__ import annotations

import time
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

from reach.grasp import Grasp
from reach.kernels.pads import pads_of
from reach.kernels.tree import mesh_tree
from reach.models.base import check_batch
from reach.models.defaults import POSE_ROTATION, POSE_TRANSLATION
from reach.models.registry import Score
from reach.models.settled import Settled, SettledContact
from reach.models.settled_grade import GRADE, Grade
from reach.models.settled_verdict import FATES, SettledVerdict
from reach.pose_error import PoseError
from reach.robustness import (
    FRICTION_SPREAD,
    MASS_SPREAD,
    check_counts,
    draw_samples,
    wilson_interval,
)
from reach.scene import Scene

Progress = Callable[[int], None]


class _ManyScores:
    """Scoring of many grasps by scoring each."""

    __slots__ = ()

    def score(
        self, scene: Scene, grasp: Grasp, *, pose_error: PoseError | None = None, seed: int = 0
    ) -> Score:
        """Score one grasp."""
        raise NotImplementedError

    def score_many(
        self,
        scene: Scene,
        grasps: Sequence[Grasp],
        *,
        pose_error: PoseError | None = None,
        seed: int = 0,
        progress: Progress | None = None,
    ) -> list[Score]:
        """Score many grasps on one part; all see the same perturbations."""
        scores = []
        for grasp in grasps:
            scores.append(self.score(scene, grasp, pose_error=pose_error, seed=seed))
            if progress:
                progress(len(scores))
        return scores


@dataclass(frozen=True, slots=True)
class SettledScorer(_ManyScores):
    """Scores 1 if the planned grasp holds the settled part, else 0."""

    model: SettledContact

    @property
    def name(self) -> str:
        """The model's name."""
        return self.model.name

    @property
    def version(self) -> str:
        """The model's version."""
        return self.model.version

    @property
    def parameters(self) -> dict[str, float | bool | str]:
        """The model's parameters."""
        return self.model.parameters

    def score(
        self, scene: Scene, grasp: Grasp, *, pose_error: PoseError | None = None, seed: int = 0
    ) -> Score:
        """Score one grasp; pose error and seed play no part. The details hold the part's path."""
        start = time.perf_counter()
        verdict = self.model.evaluate(scene, grasp)
        return Score(float(verdict.resists), time.perf_counter() - start, _details(verdict))


def _details(verdict: SettledVerdict) -> dict[str, Any]:
    settlement = verdict.settlement
    assert settlement is not None
    return {
        "margin": verdict.margin,
        "reason": str(verdict.reason),
        "missing_jaws": list(verdict.missing_jaws),
        "fate": str(settlement.fate),
        "explanation": verdict.explanation,
        "translation": settlement.translation,
        "yaw": settlement.yaw,
        "pushed": settlement.pushed,
        "lift_motion": settlement.lift_motion,
        "preload_share": settlement.preload_share,
        "path": settlement.thinned().tolist(),  # T_world_object
    }


@dataclass(frozen=True, slots=True)
class SettledRobustScorer(_ManyScores):
    """Scores the success rate under perturbed pose, friction and mass.

    Args:
        model: judges each sample.
        default_pose_error: used where a scene's own is not known.
        grade: turns what is known of all samples into a rate; None takes the share that holds.
        samples: settled grasps a score.
        friction_spread: relative standard deviation.
        mass_spread: relative standard deviation.
    """

    model: SettledContact
    default_pose_error: PoseError
    grade: Grade | None = GRADE
    samples: int = 100
    friction_spread: float = FRICTION_SPREAD
    mass_spread: float = MASS_SPREAD

    @property
    def name(self) -> str:
        """The model's name with `-robust`."""
        return f"{self.model.name}-robust"

    @property
    def version(self) -> str:
        """The model's version."""
        return self.model.version

    @property
    def parameters(self) -> dict[str, float | bool | str]:
        """The model's parameters, the spreads, and the default pose error."""
        return {
            **self.model.parameters,
            "samples": float(self.samples),
            "friction_spread": self.friction_spread,
            "mass_spread": self.mass_spread,
            "pose_translation": self.default_pose_error.translation_deviation,
            "pose_rotation": self.default_pose_error.rotation_deviation,
            "grade": "none" if self.grade is None else self.grade.version,
        }

    def score(
        self, scene: Scene, grasp: Grasp, *, pose_error: PoseError | None = None, seed: int = 0
    ) -> Score:
        """Score one grasp."""
        start = time.perf_counter()
        error = pose_error or self.default_pose_error
        told = self.settled_samples(scene, grasp, error, seed)
        held = told.margin >= 1.0
        share = float(held.mean())
        value = share if self.grade is None else self.grade.rate(scene.gripper, told)
        low, high = wilson_interval(int(held.sum()), len(held))
        counts = Counter(str(FATES[code]) for code in told.fate)
        details: dict[str, Any] = {
            "share": share,
            "low": low,
            "high": high,
            "samples": len(held),
            "counts": {str(fate): counts[str(fate)] for fate in FATES},
            "mean_margin": float(told.margin.mean()),
            "mean_translation": float(told.features[:, 1].mean()),
            "mean_yaw": float(told.features[:, 2].mean()),
            "pose_translation": error.translation_deviation,
            "pose_rotation": error.rotation_deviation,
        }
        return Score(value, time.perf_counter() - start, details)

    def settled_samples(
        self, scene: Scene, grasp: Grasp, pose_error: PoseError, seed: int
    ) -> Settled:
        """Settle every sample of [draw_samples][reach.robustness.draw_samples]."""
        T, factor, mass = draw_samples(
            scene, grasp, pose_error, self.samples, seed, self.friction_spread, self.mass_spread
        )
        batch = check_batch(
            scene, T, force=grasp.force, friction=factor * self.model.friction, mass=mass
        )
        pads = pads_of(scene.gripper, grasp.opening)
        return self.model.settle(mesh_tree(scene.object), pads, batch)


_SAMPLING = ("samples", "friction_spread", "mass_spread")


def settled_robust(
    *,
    graded: bool = True,
    pose_translation: float = POSE_TRANSLATION,
    pose_rotation: float = POSE_ROTATION,
    **overrides: Any,
) -> SettledRobustScorer:
    """Make a robust scorer; parameters that are not the sampling's are the model's.

    Raises:
        InvalidInputError: no samples, or a parameter out of its range.
    """
    sampling = {key: overrides.pop(key) for key in _SAMPLING if key in overrides}
    error = PoseError.isotropic(translation=pose_translation, rotation=pose_rotation)
    scorer = SettledRobustScorer(
        SettledContact(**overrides), error, GRADE if graded else None, **sampling
    )
    check_counts(scorer.samples, 0)
    return scorer
