"""The scores one model gave to a list of grasps."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

from reach.arrays import FloatArray, frozen

if TYPE_CHECKING:
    from reach.pose_error import PoseError

Parameter = float | bool | str


def used_parameters(
    parameters: Mapping[str, Parameter], pose_error: PoseError | None
) -> dict[str, Parameter]:
    """A scorer's parameters, its default pose error replaced by the one that was given.

    Args:
        parameters: the scorer's own.
        pose_error: that it scored under; None if it took its default.
    """
    used = dict(parameters)
    if pose_error is not None and "pose_translation" in used:
        used["pose_translation"] = pose_error.translation_deviation
        used["pose_rotation"] = pose_error.rotation_deviation
    return used


@dataclass(frozen=True, slots=True, eq=False)
class ScoredModel:
    """Scores of one model on N grasps, and what they were computed with.

    Args:
        name: of the model.
        version: of the model, as its author counts.
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
