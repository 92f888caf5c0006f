"""Labeled grasps: what every metric, table and cross-validation is computed from."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from reach.arrays import FloatArray, IntArray, frozen
from reach.errors import InvalidInputError
from reach.grasp import Grasp
from reach.scene import Scene


@dataclass(frozen=True, slots=True, eq=False)
class GraspCase:
    """One planned grasp, the scene it was planned in, and how its physical trials ended.

    Args:
        object_name: the group that averages are taken over.
        grasp_id: unique within the data set.
        scene: object at its planned pose on the table.
        grasp: the planned grasp.
        successes: trials that ended stably lifted.
        trials: trials with a valid label, at least one.

    Raises:
        InvalidInputError: counts that no set of trials has.
    """

    object_name: str
    grasp_id: str
    scene: Scene
    grasp: Grasp
    successes: int
    trials: int

    def __post_init__(self) -> None:
        if not 0 <= self.successes <= self.trials or self.trials < 1:
            raise InvalidInputError(
                f"grasp {self.grasp_id!r} has {self.successes} successes in {self.trials} trials"
            )

    @property
    def rate(self) -> float:
        """Share of its trials that succeeded."""
        return self.successes / self.trials


@dataclass(frozen=True, slots=True, eq=False)
class ObjectOutcomes:
    """The outcomes of one object's grasps, as arrays of shape (G,)."""

    name: str
    successes: IntArray
    trials: IntArray

    @property
    def rates(self) -> FloatArray:
        """Success rate of each grasp, shape (G,)."""
        result: FloatArray = self.successes / self.trials
        return result

    def majority(self) -> ObjectOutcomes:
        """One label a grasp: lifted in more than half of its trials. A tie counts as failed."""
        wins = frozen(2 * self.successes > self.trials, np.int64)
        return ObjectOutcomes(self.name, wins, frozen(np.ones_like(self.trials), np.int64))


@dataclass(frozen=True, slots=True, eq=False)
class Outcomes:
    """The outcomes of a whole data set by object, and where each object's grasps stand.

    Args:
        objects: in order of first appearance.
        indices: for each object, positions of its grasps in the list of cases, shape (G,).
    """

    objects: tuple[ObjectOutcomes, ...]
    indices: tuple[IntArray, ...]

    @classmethod
    def of(cls, cases: Sequence[GraspCase]) -> Outcomes:
        """Group cases by object.

        Raises:
            InvalidInputError: no case at all, or two cases with the same grasp id.
        """
        if not cases:
            raise InvalidInputError("no labeled grasp to evaluate")
        positions: dict[str, list[int]] = {}
        seen: set[str] = set()
        for position, case in enumerate(cases):
            if case.grasp_id in seen:
                raise InvalidInputError(f"grasp id {case.grasp_id!r} stands for two grasps")
            seen.add(case.grasp_id)
            positions.setdefault(case.object_name, []).append(position)
        objects, indices = [], []
        for name, where in positions.items():
            successes = frozen([cases[i].successes for i in where], np.int64)
            trials = frozen([cases[i].trials for i in where], np.int64)
            objects.append(ObjectOutcomes(name, successes, trials))
            indices.append(frozen(where, np.int64))
        return cls(tuple(objects), tuple(indices))

    def split(self, scores: FloatArray) -> tuple[FloatArray, ...]:
        """Scores of all cases, shape (N,), as one array per object."""
        return tuple(scores[where] for where in self.indices)

    def majority(self) -> Outcomes:
        """The same with one label a grasp."""
        return Outcomes(tuple(one.majority() for one in self.objects), self.indices)

    @property
    def without_positive(self) -> tuple[str, ...]:
        """Objects none of whose trials succeeded: AP and AR are undefined for them."""
        return tuple(one.name for one in self.objects if one.successes.sum() == 0)


def check_scores(scores: Mapping[str, FloatArray], count: int) -> None:
    """Refuse scores that are not one number in [0, 1] a grasp.

    Raises:
        InvalidInputError: naming the model and the value.
    """
    for name, values in scores.items():
        if np.shape(values) != (count,):
            raise InvalidInputError(
                f"model {name!r} gave scores of shape {np.shape(values)} for {count} grasps"
            )
        bad = ~((values >= 0.0) & (values <= 1.0))
        if np.any(bad):
            raise InvalidInputError(
                f"model {name!r} gave the score {float(values[bad][0])}, expected 0 to 1"
            )
