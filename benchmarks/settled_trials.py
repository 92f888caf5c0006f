"""Simulated trials to hold contact models against: every built-in part in the pin world.

    python benchmarks/settled_trials.py [--grasps 25] [--samples 20] [--seed 7] [--errors wide] [--meshes DIR]

Grasps are those a plan would draw; each is tried under perturbed pose, friction and mass, drawn
as the robust models draw them. A grasp's trials are kept in the cache folder when they are done,
so that a run can be stopped and taken up again; it goes around the parts, one grasp each, so that
a stopped run is a smaller benchmark of all parts.
"""

from __future__ import annotations

import argparse
import os
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from collection.objects import OBJECT_NAMES, load_object
from collection.sampling.over_poses import sample_over_poses
from reach.cache import cache_folder, cache_key
from reach.grasp import Grasp
from reach.gripper import ParallelJawGripper
from reach.models.defaults import FRICTION, POSE_ROTATION, POSE_TRANSLATION
from reach.models.dynamic import VERSION
from reach.objects import GraspObject
from reach.pose_error import PoseError
from reach.robustness import draw_samples
from reach.scene import Scene
from reach.stable_poses import stable_poses
from reach.world.parameters import WorldParameters
from reach.world.rollouts import Outcome, simulate_grasps

YUMI = ParallelJawGripper.yumi()
ERRORS = {
    "wide": PoseError.isotropic(translation=0.003, rotation=0.035),
    "station": PoseError.isotropic(translation=POSE_TRANSLATION, rotation=POSE_ROTATION),
}
"""What grasps are tried under: a station's own error, and a wider one, under which good grasps
fail now and then and bad ones succeed."""


@dataclass(frozen=True, slots=True, eq=False)
class Trials:
    """One grasp's simulated trials.

    Args:
        number: of the grasp on its part.
        scene: as planned.
        grasp: as planned.
        error: that the trials were drawn with.
        T_object_gripper: what each trial met, shape (N, 4, 4).
        friction: of each trial, shape (N,).
        mass: of each trial, shape (N,) [kg].
        outcome: codes of `reach.world.rollouts.Outcome`, shape (N,).
    """

    number: int
    scene: Scene
    grasp: Grasp
    error: PoseError
    T_object_gripper: np.ndarray
    friction: np.ndarray
    mass: np.ndarray
    outcome: np.ndarray

    @property
    def object_name(self) -> str:
        """Of the part."""
        return self.scene.object.name

    @property
    def grasp_id(self) -> str:
        """Part and number."""
        return f"{self.object_name}-{self.number}"

    @property
    def valid(self) -> np.ndarray:
        """Trials that began: the hand did not start inside part or table."""
        return (self.outcome != Outcome.COLLISION) & (self.outcome != Outcome.DIVERGED)


@dataclass(frozen=True)
class Run:
    """Which trials to simulate, or to take from the cache.

    Args:
        error: a name of ERRORS.
        grasps: of each part.
        samples: trials of each grasp.
        seed: of grasps and trials.
        meshes: folder of other parts than the built-in ones.
    """

    error: str = "wide"
    grasps: int = 25
    samples: int = 20
    seed: int = 7
    meshes: Path | None = None

    def parts(self) -> Iterator[GraspObject]:
        """The parts, in a fixed order."""
        if self.meshes is None:
            yield from (load_object(name) for name in OBJECT_NAMES)
        else:
            yield from (GraspObject.load(path) for path in sorted(self.meshes.iterdir()))

    def planned(self) -> Iterator[tuple[int, Scene, Grasp]]:
        """Grasps in the order of the run: the first of every part, the second of every part, ..."""
        by_part = []
        for part in self.parts():
            found = sample_over_poses(
                part, YUMI, stable_poses(part), count=self.grasps, seed=self.seed
            )
            order = np.random.default_rng([self.seed, 2]).permutation(len(found.grasps))
            by_part.append([(part, found.grasps[i]) for i in order])
        for number in range(self.grasps):
            for listed in by_part:
                if number < len(listed):
                    part, (pose, sampled) = listed[number]
                    scene = Scene(part, YUMI, pose.T_world_object)
                    yield number, scene, Grasp(sampled.T_object_gripper)

    def trials(self, *, simulate: bool = False) -> Iterator[Trials]:
        """Trials of each grasp from the cache; those that it lacks are simulated or left out."""
        for number, scene, grasp in self.planned():
            T, factor, mass = draw_samples(
                scene, grasp, ERRORS[self.error], self.samples, seed=1000 * self.seed + number
            )
            friction = factor * FRICTION
            path = _path(scene, T, friction, mass)
            if not path.exists():
                if not simulate:
                    continue
                told = simulate_grasps(scene, T, friction=friction, mass=mass, threads=1)
                _keep(path, told.outcome)
            outcome = np.load(path, allow_pickle=False)
            yield Trials(number, scene, grasp, ERRORS[self.error], T, friction, mass, outcome)


def _path(scene: Scene, T: np.ndarray, friction: np.ndarray, mass: np.ndarray) -> Path:
    key = cache_key(
        VERSION, scene.object.content_hash, scene.object.mass, T.tobytes(), friction.tobytes(),
        mass.tobytes(), scene.T_world_object.tobytes(), WorldParameters(),
    )  # fmt: skip
    return cache_folder() / "settled-trials" / f"{key}.npy"


def _keep(path: Path, outcome: np.ndarray) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    temporary = path.with_suffix(f".{os.getpid()}.part")
    with temporary.open("wb") as stream:
        np.save(stream, outcome)
    os.replace(temporary, path)


def add_options(parser: argparse.ArgumentParser) -> None:
    """Let a command line choose the trials."""
    parser.add_argument("--grasps", type=int, default=Run.grasps)
    parser.add_argument("--samples", type=int, default=Run.samples)
    parser.add_argument("--seed", type=int, default=Run.seed)
    parser.add_argument("--meshes", type=Path)
    parser.add_argument("--errors", nargs="+", choices=ERRORS, default=list(ERRORS))


def chosen_runs(told: argparse.Namespace) -> list[Run]:
    """One run for each pose error."""
    return [Run(name, told.grasps, told.samples, told.seed, told.meshes) for name in told.errors]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    add_options(parser)
    runs = chosen_runs(parser.parse_args())
    start, cpu = time.perf_counter(), time.process_time()
    for done, each in enumerate(zip(*(run.trials(simulate=True) for run in runs), strict=True)):
        held = (
            f"{run.error} {int((trials.outcome == Outcome.HELD).sum())} of "
            f"{int(trials.valid.sum())}"
            for run, trials in zip(runs, each, strict=True)
        )
        print(
            f"{done + 1:4} {time.perf_counter() - start:6.0f} s wall "
            f"{time.process_time() - cpu:6.0f} s CPU  {each[0].grasp_id} held: {', '.join(held)}",
            flush=True,
        )


if __name__ == "__main__":
    main()
