"""Cost of the contact models, measured in one run and compared as ratios.

    python benchmarks/contact_models.py [--json OUT]

Times are CPU time of this process, the least of several repetitions, after one call that loads or
compiles the kernels. Everything but the last row runs on one core.
"""

from __future__ import annotations

import argparse
import json
import os
import resource
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np

from reach import (
    AreaContact,
    EllipseContact,
    Grasp,
    GraspObject,
    ParallelJawGripper,
    PointContact,
    PoseError,
    Scene,
    reliability,
)
from reach.models.reference import ReferenceAreaContact
from reach.transforms import exp, make_transform

ERROR = PoseError.isotropic(translation=0.003, rotation=0.035)


def seconds(function: Callable[[], object], repeat: int = 7, least: float = 0.03) -> float:
    """CPU seconds of one call: the least of several means."""
    function()
    number = 1
    while True:
        start = time.process_time()
        for _ in range(number):
            function()
        if time.process_time() - start >= least:
            break
        number *= 2
    times = []
    for _ in range(repeat):
        start = time.process_time()
        for _ in range(number):
            function()
        times.append((time.process_time() - start) / number)
    return min(times)


def dented_ball(subdivisions: int) -> GraspObject:
    """A curved part with dents, 4 cm across: every facet of a patch has its own normal."""
    import trimesh

    mesh = trimesh.creation.icosphere(subdivisions, 0.02)
    mesh.vertices *= 1 + 0.08 * np.sin(200 * mesh.vertices[:, [1, 2, 0]])
    return GraspObject(f"ball{subdivisions}", mesh.vertices, mesh.faces, 0.05)


def box(subdivisions: int) -> GraspObject:
    """A flat-sided part: 12 faces, or many coplanar ones."""
    import trimesh

    mesh = trimesh.creation.box((0.03, 0.03, 0.03))
    for _ in range(subdivisions):
        mesh = mesh.subdivide()
    return GraspObject(f"box{subdivisions}", mesh.vertices, mesh.faces, 0.05)


def scene_and_grasps(part: GraspObject, count: int = 64) -> tuple[Scene, np.ndarray]:
    rng = np.random.default_rng(0)
    scene = Scene(part, ParallelJawGripper.yumi(), np.eye(4))
    center = make_transform(None, part.com)
    noise = rng.normal(size=(count, 6)) * ([0.3] * 3 + [0.003] * 3)
    return scene, center @ exp(noise) @ make_transform(None, (0, 0, -0.160))


def single(model, scene: Scene, poses: np.ndarray) -> float:
    """Seconds of one verdict through the public call, averaged over grasps."""
    grasps = [Grasp(T) for T in poses[:16]]
    return seconds(lambda: [model.evaluate(scene, grasp) for grasp in grasps]) / len(grasps)


def in_batch(model, scene: Scene, poses: np.ndarray) -> float:
    return seconds(lambda: model.evaluate_batch(scene, poses)) / len(poses)


def robust(model, scene: Scene, poses: np.ndarray, samples: int) -> float:
    grasps = [Grasp(T) for T in poses[:8]]
    return seconds(
        lambda: [reliability(model, scene, g, pose_error=ERROR, samples=samples) for g in grasps],
        repeat=3,
    ) / len(grasps)


def measure() -> dict[str, object]:
    scene, poses = scene_and_grasps(dented_ball(3))
    faces = len(scene.object.faces)
    verdict = in_batch(AreaContact(), scene, poses)
    rows: dict[str, object] = {"faces": faces, "verdict_ms": 1e3 * verdict}
    rows["verdict_single_call_ms"] = 1e3 * single(AreaContact(), scene, poses)
    rows["robust_100_ms"] = 1e3 * robust(AreaContact(), scene, poses, 100)
    rows["point_over_reach"] = in_batch(PointContact(), scene, poses) / verdict
    rows["ellipse_over_reach"] = in_batch(EllipseContact(), scene, poses) / verdict
    few = [Grasp(T) for T in poses[:4]]
    for name, kept in (("ten_largest", 10), ("all_triangles", None)):
        model = ReferenceAreaContact(triangles=kept)
        cost = seconds(lambda m=model: [m.evaluate(scene, g) for g in few], 1, 0.0) / len(few)
        rows[f"reference_{name}_ms"] = 1e3 * cost
        rows[f"reference_{name}_over_compiled"] = cost / verdict
    rows["cost_by_faces_ms"] = {
        kind.__name__: {
            len(part.faces): 1e3 * in_batch(AreaContact(), *scene_and_grasps(part))
            for part in map(kind, levels)
        }
        for kind, levels in ((dented_ball, (1, 2, 3, 4, 5, 6)), (box, (0, 2, 4, 5, 6)))
    }
    curved = rows["cost_by_faces_ms"]["dented_ball"]  # type: ignore[index]
    rows["20480_over_1280_faces"] = curved[20480] / curved[1280]
    rows["cost_by_samples_ms"] = {
        n: 1e3 * robust(AreaContact(), scene, poses, n) for n in (1, 10, 100, 1000)
    }
    rows["hundred_thousand"] = hundred_thousand(scene)
    return rows


def hundred_thousand(scene: Scene) -> dict[str, float]:
    """Wall time of 100,000 grasps on all cores, and how much memory they add."""
    _, poses = scene_and_grasps(scene.object, 100_000)
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    start = time.perf_counter()
    AreaContact().evaluate_batch(scene, poses)
    return {
        "wall_seconds": time.perf_counter() - start,
        "cores": os.cpu_count() or 1,
        "grown_megabytes": (resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before) / 1024,
    }


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--json", type=Path)
    arguments = parser.parse_args()
    rows = measure()
    for name, value in rows.items():
        if isinstance(value, dict):
            print(f"{name}:")
            for key, entry in value.items():
                shown = (
                    {k: round(v, 4) for k, v in entry.items()}
                    if isinstance(entry, dict)
                    else f"{entry:.4g}"
                )
                print(f"    {key:>14}  {shown}")
        else:
            print(f"{name:38} {value:.4g}")
    if arguments.json:
        arguments.json.write_text(json.dumps(rows, indent=1))


if __name__ == "__main__":
    main()
