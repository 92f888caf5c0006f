"""How long a whole experiment takes to export and to evaluate: 21 objects x 25 grasps x 5 repeats.

    python benchmarks/dataset.py SESSION_OR_DATASET...

CPU seconds, so that a busy machine does not change the figures much.
"""

from __future__ import annotations

import argparse
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import TypeVar

from logs.dataset.files import FORMATS, read_dataset, write_dataset
from logs.dataset.sources import load_labeled
from reach.evaluation.compare import compare, scorers_of
from reach.pose_error import PoseError

MODELS = ("point", "point-robust", "ellipse", "ellipse-robust", "reach", "reach-robust")
T = TypeVar("T")


def timed(name: str, work: Callable[[], T]) -> T:
    """Do some work and print its CPU and wall time."""
    cpu, wall = time.process_time(), time.perf_counter()
    result = work()
    print(f"{name:24} {time.process_time() - cpu:7.2f} s CPU {time.perf_counter() - wall:7.2f} s")
    return result


def main() -> None:
    """Time reading, writing in all formats, reading back, and evaluating."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("sources", nargs="+", type=Path)
    sources = parser.parse_args().sources
    dataset = timed("read", lambda: load_labeled(sources))
    print(f"{len(dataset.trials)} trials of {len(dataset.by_grasp())} grasps")
    with tempfile.TemporaryDirectory() as folder:
        target = Path(folder) / "d"
        timed("write, all formats", lambda: write_dataset(dataset, target, FORMATS))
        timed("read back", lambda: read_dataset(target))
    error = PoseError.isotropic(translation=1e-3, rotation=3e-3)
    cases, scorers = dataset.cases(), scorers_of(MODELS)
    scorers[-1].score(cases[0].scene, cases[0].grasp, pose_error=error, seed=0)  # compile first
    timed(
        "evaluate, analytic",
        lambda: compare(cases, scorers, pose_error=error, use_cache=False),
    )


if __name__ == "__main__":
    main()
