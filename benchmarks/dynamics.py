"""Cost and convergence of the grasp world, the simulated trial and the dynamic model.

    python -m benchmarks.dynamics [--json OUT]

Times are CPU time of this process unless they say wall. The first call of everything is left out.
"""

from __future__ import annotations

import argparse
import json
import os
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import trimesh

from collection.objects import load_object
from collection.robots.motion import execute_grasp
from collection.station.station import load_station
from reach import Grasp, GraspObject, ParallelJawGripper, Scene
from reach.models.dynamic import make_dynamic
from reach.stable_poses import stable_poses
from reach.transforms import exp, inverse, make_transform, rotation_about
from reach.world.decomposition import convex_parts
from reach.world.parameters import WorldParameters
from reach.world.rollouts import simulate_grasps

YUMI = ParallelJawGripper.yumi()
PADS_Z = 0.160098
DYNAMIC_OBJECTS = ("cube_3cm", "star", "pawn", "mug")


def from_above(scene: Scene, yaw: float = 0.0, height: float = 0.0) -> np.ndarray:
    """T_object_gripper straight down on the center of mass."""
    down = rotation_about((0, 0, 1), yaw) @ np.diag([1.0, -1.0, -1.0])
    center = scene.T_world_object[:3, :3] @ scene.object.com + scene.T_world_object[:3, 3]
    T_world_gripper = make_transform(down, center + (0, 0, PADS_Z + height))
    return np.array(inverse(scene.T_world_object) @ T_world_gripper)


def lying(obj: GraspObject) -> Scene:
    return Scene(obj, YUMI, stable_poses(obj)[0].T_world_object)


def timed(function: Callable[[], Any]) -> dict[str, float]:
    function()
    wall, cpu = time.perf_counter(), time.process_time()
    function()
    return {"cpu": time.process_time() - cpu, "wall": time.perf_counter() - wall}


def close_lift_hold() -> dict[str, float]:
    """One cube between faces, without early exit: 0.4 s closing, 0.3 s lift, 1 s hold."""
    from reach.world.grasp_world import GraspWorld

    scene = lying(load_object("cube_3cm"))
    T = scene.T_world_object @ from_above(scene)

    def run() -> None:
        world = GraspWorld(scene.object, YUMI, scene.T_world_object, T, WorldParameters())
        world.set_jaw_force(20.0)
        world.advance(0.4)
        for share in np.linspace(0, 1, 76):
            world.set_target(make_transform(None, (0, 0, 0.1 * share)) @ T)
            world.advance(0.004)
        world.advance(1.0)

    return timed(run)


def trial() -> dict[str, float]:
    """Placing, image and trial motion on the simulated station; no registration, no logging."""
    obj = load_object("cube_3cm")
    pose = stable_poses(obj)[0]
    rng = np.random.default_rng(0)
    with load_station("simulated") as station:
        simulation = station.simulation
        assert simulation is not None

        def run() -> None:
            simulation.place(obj, pose, rng)
            station.camera.capture()
            scene = Scene(obj, YUMI, simulation.true_T_world_object())
            T = scene.T_world_object @ from_above(scene, yaw=0.2)
            execute_grasp(station.arm, station.gripper, T, station.clock)

        return timed(run)


def dynamic() -> dict[str, dict[str, float]]:
    """100 samples of a grasp that holds: no early failure makes it cheap."""
    rows = {}
    for name in DYNAMIC_OBJECTS:
        scene = lying(load_object(name))
        parts = len(convex_parts(scene.object))
        scorer = make_dynamic()
        grasp = Grasp(from_above(scene))
        rows[name] = {
            **timed(lambda: scorer.score(scene, grasp, seed=1)),  # noqa: B023
            "score": scorer.score(scene, grasp, seed=1).value,
            "parts": parts,
        }
    return rows


def cached_decomposition() -> dict[str, float]:
    obj = load_object("mug")
    return timed(lambda: convex_parts(obj))


def timestep_agreement(count: int = 60) -> dict[str, float]:
    """Share of trials whose outcome is that at 1 ms, on five shapes with strong jitter."""
    solids = {
        "cube": trimesh.creation.box((0.03, 0.03, 0.03)),
        "bar": trimesh.creation.box((0.12, 0.02, 0.025)),
        "cylinder": trimesh.creation.cylinder(0.012, 0.06, sections=24),
        "ball": trimesh.creation.icosphere(2, 0.018),
        "wedge": trimesh.creation.cone(0.02, 0.04, sections=12),
    }
    agree: dict[str, list[np.ndarray]] = {}
    for name, mesh in solids.items():
        scene = lying(GraspObject(name, mesh.vertices, mesh.faces, 0.02))
        rng = np.random.default_rng(0)
        poses = np.array(
            [
                from_above(scene, rng.uniform(-3, 3), rng.uniform(0.002, 0.012))
                @ exp(rng.normal(0.0, [0.03] * 3 + [0.003] * 3))
                for _ in range(count)
            ]
        )
        friction = np.linspace(0.1, 0.6, count)
        outcomes = {
            step: simulate_grasps(
                scene, poses, WorldParameters(timestep=step), friction=friction
            ).lifted
            for step in (1e-3, 2e-3, 4e-3, 5e-3)
        }
        for step, lifted in outcomes.items():
            agree.setdefault(f"{step * 1e3:g} ms", []).append(lifted == outcomes[1e-3])
    return {step: float(np.mean(np.concatenate(each))) for step, each in agree.items()}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--json", type=Path)
    arguments = parser.parse_args()
    results = {
        "cores": os.cpu_count(),
        "close, lift, hold [s]": close_lift_hold(),
        "whole trial without registration and logging [s]": trial(),
        "dynamic, 100 samples [s]": dynamic(),
        "second load of a decomposition [s]": cached_decomposition(),
        "agreement with 1 ms": timestep_agreement(),
    }
    text = json.dumps(results, indent=2)
    print(text)
    if arguments.json is not None:
        arguments.json.write_text(text + "\n")


if __name__ == "__main__":
    main()
