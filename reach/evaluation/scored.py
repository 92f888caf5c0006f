"""The scores one model gave to a list of grasps."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from reach.arrays import FloatArray, frozen

Parameter = float | bool | str


@dataclass(frozen=True, slots=True, eq=False)
class ScoredModel:
    """Scores of one model on N grasps, and what they were computed with.

    Args:
        name: of the model.
        version: of its code; a new one invalidates cached scores.
        parameters: what the scores depend on.
        values: scores in [0, 1], shape (N,).
        seconds_per_grasp: median wall time of one score, measured in this run.
    """

    name: str
    version: str
    parameters: Mapping[str, Parameter]
    values: FloatArray
    seconds_per_grasp: float

    def __post_init__(self) -> None:
        object.__setattr__(self, "values", frozen(self.values))
