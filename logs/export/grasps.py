"""One row a planned grasp: what the formats that know no repeats are written from."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from logs.dataset.dataset import Dataset
from logs.dataset.labeled_trial import LabeledTrial
from reach.arrays import FloatArray
from reach.evaluation.overlap import closed_width


@dataclass(frozen=True, slots=True, eq=False)
class GraspSummary:
    """A planned grasp and how its trials ended.

    Args:
        grasp_id: unique in the data set.
        T_object_gripper: planned, shape (4, 4).
        successes: of its trials.
        trials: number of its trials.
        width: of the object between the closed pads [m]: the mean of what the jaws measured in
            the successful trials, else from the mesh; None if a pad meets nothing.
        simulated: any of its trials was.
    """

    grasp_id: str
    T_object_gripper: FloatArray
    successes: int
    trials: int
    width: float | None
    simulated: bool

    @property
    def rate(self) -> float:
        """Share of its trials that succeeded."""
        return self.successes / self.trials

    @property
    def majority(self) -> bool:
        """Lifted in more than half of its trials; a tie counts as failed."""
        return 2 * self.successes > self.trials


def summarize(dataset: Dataset) -> dict[str, list[GraspSummary]]:
    """Summaries of every object's grasps, objects by name, grasps by attempt."""
    result: dict[str, list[GraspSummary]] = {}
    for grasp_id, trials in dataset.by_grasp().items():
        first = trials[0]
        summary = GraspSummary(
            grasp_id,
            first.T_object_gripper,
            sum(trial.label.success for trial in trials),
            len(trials),
            _width(dataset, trials),
            any(trial.simulated for trial in trials),
        )
        result.setdefault(first.object_name, []).append(summary)
    return result


def _width(dataset: Dataset, trials: list[LabeledTrial]) -> float | None:
    measured = [
        trial.execution.jaw_width
        for trial in trials
        if trial.label.success and trial.execution.jaw_width is not None
    ]
    if measured:
        return float(np.mean(measured))
    part = dataset.objects[trials[0].object_name]
    return closed_width(part, dataset.gripper, trials[0].T_object_gripper, trials[0].opening)
