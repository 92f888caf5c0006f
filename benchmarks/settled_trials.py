"""Simulated trials to hold contact models against: every built-in part in the pin world.

    python benchmarks/settled_trials.py [--grasps 25] [--samples 20] [--seed 7]

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
from reach.models.defaults import FRICTION
from reach.pose_error import PoseError
from reach.robustness import draw_samples
from reach.scene import Scene
from reach.stable_poses import stable_poses
from reach.world.parameters import WorldParameters
from reach.world.rollouts import Outcome, simulate_grasps

VERSION = 1
YUMI = ParallelJawGripper.yumi()
ERROR = PoseError.isotropic(translation=0.003, rotation=0.035)
"""Wider than a station's own, so that good grasps fail now and then and bad ones succeed."""


@dataclass(frozen=True, slots=True, eq=False)
class Trials:
    """One grasp's simulated trials.

    Args:
        object_name: of the part.
        number: of the grasp on this part.
        scene: as planned.
        grasp: as planned.
        T_object_gripper: what each trial met, shape (N, 4, 4).
        friction: of each trial, shape (N,).
        mass: of each trial, shape (N,) [kg].
        outcome: codes of `reach.world.rollouts.Outcome`, shape (N,).
    """

    object_name: str
    number: int
    scene: Scene
    grasp: Grasp
    T_object_gripper: np.ndarray
    friction: np.ndarray
    mass: np.ndarray
    outcome: np.ndarray

    @property
    def valid(self) -> np.ndarray:
        """Trials that began: the hand did not start inside part or table."""
        return (self.outcome != Outcome.COLLISION) & (self.outcome != Outcome.DIVERGED)


def planned(grasps: int, seed: int) -> Iterator[tuple[str, int, Scene, Grasp]]:
    """Grasps in the order of the run: the first of every part, the second of every part, ..."""
    by_part = {}
    for name in OBJECT_NAMES:
        obj = load_object(name)
        samples = sample_over_poses(obj, YUMI, stable_poses(obj), count=grasps, seed=seed)
        order = np.random.default_rng([seed, 2]).permutation(len(samples.grasps))
        by_part[name] = [(obj, samples.grasps[i]) for i in order]
    for number in range(grasps):
        for name, listed in by_part.items():
            if number < len(listed):
                obj, (pose, sampled) = listed[number]
                scene = Scene(obj, YUMI, pose.T_world_object)
                yield name, number, scene, Grasp(sampled.T_object_gripper)


def trials_of(
    name: str, number: int, scene: Scene, grasp: Grasp, samples: int, seed: int, *, simulate: bool
) -> Trials | None:
    """One grasp's trials from the cache; simulated if absent, or None if that is not wanted."""
    T, friction, mass = draw_samples(scene, grasp, ERROR, samples, seed=1000 * seed + number)
    friction = friction * FRICTION
    key = cache_key(
        VERSION, scene.object.content_hash, scene.object.mass, T.tobytes(), friction.tobytes(),
        mass.tobytes(), scene.T_world_object.tobytes(), WorldParameters(),
    )  # fmt: skip
    path = cache_folder() / "settled-trials" / f"{key}.npy"
    if path.exists():
        outcome = np.load(path, allow_pickle=False)
    elif simulate:
        outcome = simulate_grasps(scene, T, friction=friction, mass=mass, threads=1).outcome
        _keep(path, outcome)
    else:
        return None
    return Trials(name, number, scene, grasp, T, friction, mass, outcome)


def _keep(path: Path, outcome: np.ndarray) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    temporary = path.with_suffix(f".{os.getpid()}.part")
    with temporary.open("wb") as stream:
        np.save(stream, outcome)
    os.replace(temporary, path)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--grasps", type=int, default=25)
    parser.add_argument("--samples", type=int, default=20)
    parser.add_argument("--seed", type=int, default=7)
    arguments = parser.parse_args()
    start, cpu = time.perf_counter(), time.process_time()
    for done, (name, number, scene, grasp) in enumerate(planned(arguments.grasps, arguments.seed)):
        trials = trials_of(
            name, number, scene, grasp, arguments.samples, arguments.seed, simulate=True
        )
        assert trials is not None
        print(
            f"{done + 1:4} {time.perf_counter() - start:6.0f} s wall "
            f"{time.process_time() - cpu:6.0f} s CPU  {name} {number}: "
            f"{int((trials.outcome == Outcome.HELD).sum())} of {int(trials.valid.sum())} held",
            flush=True,
        )


if __name__ == "__main__":
    main()
