"""How long does it take to sample grasps, and what becomes of the candidates?

    .venv/bin/python benchmarks/sampling.py
    .venv/bin/python benchmarks/sampling.py path/to/meshes/*.obj

Times are CPU seconds of this process. The first table shoots 10,000 candidate rays on each part
with everything checked (collision, jitter, duplicates); the second plans 25 grasps.
"""

from __future__ import annotations

import argparse
import time

import numpy as np

from collection.errors import NoGraspError
from collection.objects import OBJECT_NAMES, load_object
from collection.sampling import SamplingOptions, sample_grasps
from collection.sampling.over_poses import sample_over_poses
from reach.gripper import ParallelJawGripper
from reach.objects import GraspObject
from reach.stable_poses import stable_poses

CANDIDATES = 10_000
GRIPPER = ParallelJawGripper.yumi()


def seconds_for_candidates(part: GraspObject) -> tuple[float, int]:
    """CPU seconds for CANDIDATES rays on the likeliest pose, and how many grasps they gave."""
    pose = stable_poses(part)[0]
    options = SamplingOptions(max_candidates=CANDIDATES)
    start = time.process_time()
    result = sample_grasps(
        part, GRIPPER, pose, count=CANDIDATES, rng=np.random.default_rng(0), options=options
    )
    return time.process_time() - start, len(result.grasps)


def row(part: GraspObject) -> str:
    """One line of the table."""
    poses = stable_poses(part)
    seconds, kept = seconds_for_candidates(part)
    start = time.process_time()
    try:
        samples = sample_over_poses(part, GRIPPER, poses, count=25, seed=0)
        left_out = sum(not search.grasps for search in samples.searches.values())
        planned = f"{len(samples.grasps):3d} grasps, {left_out} poses left out"
    except NoGraspError as error:
        planned = str(error)
    planning = time.process_time() - start
    return (
        f"{part.name:22} {len(part.faces):6d} {len(poses):5d} {seconds:9.2f} {kept:6d} "
        f"{planning:9.2f}  {planned}"
    )


def main() -> None:
    arguments = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    arguments.add_argument("meshes", nargs="*", default=OBJECT_NAMES)
    arguments.add_argument("--mesh-unit", default="m")
    options = arguments.parse_args()
    seconds_for_candidates(load_object("cube_3cm"))  # compiles the kernels
    print(f"{'part':22} {'faces':>6} {'poses':>5} {'s/10,000':>9} {'kept':>6} {'s/plan':>9}")
    for name in options.meshes:
        print(row(load_object(name, options.mesh_unit)), flush=True)


if __name__ == "__main__":
    main()
