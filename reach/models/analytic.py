"""Scorers of the analytic contact models: nominal, and robust against what is not known exactly."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from reach.contact import REASONS, VerdictBatch
from reach.grasp import Grasp
from reach.models.area import AreaContact
from reach.models.base import ContactModel
from reach.models.defaults import POSE_ROTATION, POSE_TRANSLATION
from reach.models.ellipse import EllipseContact
from reach.models.point import PointContact
from reach.models.registry import Score, Scorer
from reach.pose_error import PoseError
from reach.robustness import FRICTION_SPREAD, MASS_SPREAD, check_counts, reliability
from reach.scene import Scene


@dataclass(frozen=True, slots=True)
class NominalScorer:
    """Scores 1 if the planned grasp resists gravity, else 0."""

    model: ContactModel

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
        """Score one grasp; pose error and seed play no part."""
        start = time.perf_counter()
        verdict = self.model.evaluate(scene, grasp)
        details = {
            "margin": verdict.margin,
            "reason": str(verdict.reason),
            "missing_jaws": list(verdict.missing_jaws),
        }
        return Score(float(verdict.resists), time.perf_counter() - start, details)

    def score_many(
        self,
        scene: Scene,
        grasps: Sequence[Grasp],
        *,
        pose_error: PoseError | None = None,
        seed: int = 0,
        progress: Callable[[int], None] | None = None,
    ) -> list[Score]:
        """Score many grasps on one part in one batch; each is given an equal share of the time."""
        if any(grasp.opening is not None for grasp in grasps):
            return _one_by_one(self, scene, grasps, pose_error, seed, progress)
        if not grasps:
            return []
        start = time.perf_counter()
        batch = self.model.evaluate_batch(
            scene,
            np.array([grasp.T_object_gripper for grasp in grasps]),
            force=np.array([grasp.force for grasp in grasps]),
            progress=progress,
        )
        seconds = (time.perf_counter() - start) / len(grasps)
        return [_score_of(batch, index, seconds) for index in range(len(grasps))]


def _score_of(batch: VerdictBatch, index: int, seconds: float) -> Score:
    missing = int(batch.missing[index])
    details = {
        "margin": float(batch.margin[index]),
        "reason": str(REASONS[int(batch.reason[index])]),
        "missing_jaws": [jaw for jaw in range(missing.bit_length()) if missing >> jaw & 1],
    }
    return Score(float(batch.resists[index]), seconds, details)


@dataclass(frozen=True, slots=True)
class RobustScorer:
    """Scores the reliability under perturbed pose, friction and mass.

    Args:
        model: judges each sample.
        default_pose_error: used where a scene's own is not known.
        samples: verdicts a grasp.
        friction_spread: relative standard deviation.
        mass_spread: relative standard deviation.
        adaptive: stop when the confidence interval is narrower than this; None draws all samples.
    """

    model: ContactModel
    default_pose_error: PoseError
    samples: int = 100
    friction_spread: float = FRICTION_SPREAD
    mass_spread: float = MASS_SPREAD
    adaptive: float | None = None

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
        own: dict[str, float | bool | str] = {
            "samples": float(self.samples),
            "friction_spread": self.friction_spread,
            "mass_spread": self.mass_spread,
            "pose_translation": self.default_pose_error.translation_deviation,
            "pose_rotation": self.default_pose_error.rotation_deviation,
        }
        if self.adaptive is not None:
            own["adaptive"] = self.adaptive
        return {**self.model.parameters, **own}

    def score(
        self, scene: Scene, grasp: Grasp, *, pose_error: PoseError | None = None, seed: int = 0
    ) -> Score:
        """Score one grasp."""
        start = time.perf_counter()
        error = pose_error or self.default_pose_error
        q = reliability(
            self.model,
            scene,
            grasp,
            pose_error=error,
            samples=self.samples,
            seed=seed,
            friction_spread=self.friction_spread,
            mass_spread=self.mass_spread,
            adaptive=self.adaptive,
        )
        details: dict[str, Any] = {
            "low": q.low,
            "high": q.high,
            "samples": q.samples,
            "counts": q.counts,
            "mean_margin": q.mean_margin,
            "pose_translation": error.translation_deviation,
            "pose_rotation": error.rotation_deviation,
        }
        return Score(q.value, time.perf_counter() - start, details)

    def score_many(
        self,
        scene: Scene,
        grasps: Sequence[Grasp],
        *,
        pose_error: PoseError | None = None,
        seed: int = 0,
        progress: Callable[[int], None] | None = None,
    ) -> list[Score]:
        """Score many grasps on one part; all see the same perturbations."""
        return _one_by_one(self, scene, grasps, pose_error, seed, progress)


def _one_by_one(
    scorer: Scorer,
    scene: Scene,
    grasps: Sequence[Grasp],
    pose_error: PoseError | None,
    seed: int,
    progress: Callable[[int], None] | None,
) -> list[Score]:
    scores = []
    for grasp in grasps:
        scores.append(scorer.score(scene, grasp, pose_error=pose_error, seed=seed))
        if progress:
            progress(len(scores))
    return scores


_ROBUST = ("samples", "friction_spread", "mass_spread", "adaptive")


def robust(
    model: type[Any],
    *,
    pose_translation: float = POSE_TRANSLATION,
    pose_rotation: float = POSE_ROTATION,
    **overrides: Any,
) -> RobustScorer:
    """Make a robust scorer; parameters that are not the sampling's are the model's."""
    sampling = {key: overrides.pop(key) for key in _ROBUST if key in overrides}
    error = PoseError.isotropic(translation=pose_translation, rotation=pose_rotation)
    scorer = RobustScorer(model(**overrides), error, **sampling)
    check_counts(scorer.samples, 0)
    return scorer


def make_reach(**overrides: Any) -> NominalScorer:
    """REACH at the planned pose."""
    return NominalScorer(AreaContact(**overrides))


def make_reach_robust(**overrides: Any) -> RobustScorer:
    """REACH, robust."""
    return robust(AreaContact, **overrides)


def make_point(**overrides: Any) -> NominalScorer:
    """Soft point contact at the planned pose."""
    return NominalScorer(PointContact(**overrides))


def make_point_robust(**overrides: Any) -> RobustScorer:
    """Soft point contact, robust."""
    return robust(PointContact, **overrides)


def make_ellipse(**overrides: Any) -> NominalScorer:
    """Elliptical area contact at the planned pose."""
    return NominalScorer(EllipseContact(**overrides))


def make_ellipse_robust(**overrides: Any) -> RobustScorer:
    """Elliptical area contact, robust."""
    return robust(EllipseContact, **overrides)
