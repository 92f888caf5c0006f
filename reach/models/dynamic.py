"""Full dynamics as a baseline: perturbed trials of close, lift and hold in the pin world.

The counterpart of the paper's Flex baseline ([Danielczuk2019] Sect. 5.3): the score is the share
of simulated trials that lift the part.
"""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from reach.arrays import positive
from reach.errors import InvalidInputError
from reach.grasp import Grasp
from reach.models.defaults import FRICTION, POSE_ROTATION, POSE_TRANSLATION
from reach.models.registry import Score
from reach.pose_error import PoseError
from reach.robustness import FRICTION_SPREAD, MASS_SPREAD, draw_samples, wilson_interval
from reach.scene import Scene
from reach.world.parameters import WorldParameters
from reach.world.rollouts import LiftOutcomes, Outcome, simulate_grasps

VERSION = "2"
SAMPLES = 100


@dataclass(frozen=True, slots=True)
class DynamicModel:
    """Scores a grasp by simulating it many times.

    Args:
        friction: between pads and part.
        table_friction: between table and part.
        pad_modulus: Young's modulus of the pads [Pa].
        pad_thickness: of their soft layer [m].
        samples: simulated trials a grasp.
        friction_spread: relative standard deviation.
        mass_spread: relative standard deviation.
        default_pose_error: used where a scene's own is not known.
        threads: that share the work; the score does not depend on it.
    """

    friction: float = FRICTION
    table_friction: float = 0.4
    pad_modulus: float = 0.6e6
    pad_thickness: float = 4e-3
    samples: int = SAMPLES
    friction_spread: float = FRICTION_SPREAD
    mass_spread: float = MASS_SPREAD
    default_pose_error: PoseError = field(
        default_factory=lambda: PoseError.isotropic(
            translation=POSE_TRANSLATION, rotation=POSE_ROTATION
        )
    )
    threads: int = field(default_factory=lambda: os.cpu_count() or 1)

    def __post_init__(self) -> None:
        if self.samples < 1:
            raise InvalidInputError(f"samples is {self.samples!r}, expected at least 1")
        positive(self.friction_spread, "friction_spread", zero_allowed=True)
        positive(self.mass_spread, "mass_spread", zero_allowed=True)
        self.world()  # refuses what the world refuses

    @property
    def name(self) -> str:
        """The model's name."""
        return "dynamic"

    @property
    def version(self) -> str:
        """The model's version."""
        return VERSION

    @property
    def parameters(self) -> dict[str, float | bool | str]:
        """All that the scores depend on."""
        return {
            "friction": self.friction,
            "table_friction": self.table_friction,
            "pad_modulus": self.pad_modulus,
            "pad_thickness": self.pad_thickness,
            "timestep": self.world().timestep,
            "samples": float(self.samples),
            "friction_spread": self.friction_spread,
            "mass_spread": self.mass_spread,
            "pose_translation": self.default_pose_error.translation_deviation,
            "pose_rotation": self.default_pose_error.rotation_deviation,
        }

    def world(self) -> WorldParameters:
        """The parameters of the pin world."""
        return WorldParameters(
            friction=self.friction,
            table_friction=self.table_friction,
            pad_modulus=self.pad_modulus,
            pad_thickness=self.pad_thickness,
        )

    def simulate(
        self, scene: Scene, grasp: Grasp, *, pose_error: PoseError | None = None, seed: int = 0
    ) -> LiftOutcomes:
        """Simulate the perturbed trials behind a score; the first n are the same for more."""
        T, friction, mass = draw_samples(
            scene,
            grasp,
            pose_error or self.default_pose_error,
            self.samples,
            seed,
            self.friction_spread,
            self.mass_spread,
        )
        return simulate_grasps(
            scene,
            T,
            self.world(),
            force=grasp.force,
            opening=grasp.opening,
            friction=self.friction * friction,
            mass=mass,
            threads=self.threads,
        )

    def score(
        self, scene: Scene, grasp: Grasp, *, pose_error: PoseError | None = None, seed: int = 0
    ) -> Score:
        """Score one grasp: the share of its simulated trials that lift the part."""
        start = time.perf_counter()
        error = pose_error or self.default_pose_error
        outcomes = self.simulate(scene, grasp, pose_error=error, seed=seed)
        lifted = int(outcomes.lifted.sum())
        low, high = wilson_interval(lifted, self.samples)
        details: dict[str, Any] = {
            "low": low,
            "high": high,
            "samples": self.samples,
            "counts": _counts(outcomes),
            "mean_turned": float(outcomes.turned[outcomes.lifted].mean()) if lifted else 0.0,
            "pose_translation": error.translation_deviation,
            "pose_rotation": error.rotation_deviation,
        }
        return Score(lifted / self.samples, time.perf_counter() - start, details)

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
        scores = []
        for grasp in grasps:
            scores.append(self.score(scene, grasp, pose_error=pose_error, seed=seed))
            if progress is not None:
                progress(len(scores))
        return scores


def make_dynamic(
    *,
    pose_translation: float = POSE_TRANSLATION,
    pose_rotation: float = POSE_ROTATION,
    **overrides: Any,
) -> DynamicModel:
    """The dynamic baseline, as the registry names it."""
    error = PoseError.isotropic(translation=pose_translation, rotation=pose_rotation)
    return DynamicModel(default_pose_error=error, **overrides)


def _counts(outcomes: LiftOutcomes) -> dict[str, int]:
    numbers = np.bincount(outcomes.outcome, minlength=len(Outcome))
    return {each.name.lower(): int(numbers[each]) for each in Outcome if numbers[each]}
