"""Names of the scoring models, and how each is made.

A scorer turns a grasp into a number in [0, 1] and what stands behind it. Every model lives in its
own file and is imported when it is first asked for.
"""

from __future__ import annotations

import importlib
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any, Protocol

from reach.errors import InvalidInputError, UnknownNameError
from reach.grasp import Grasp
from reach.models.names import MODEL_NAMES
from reach.pose_error import PoseError
from reach.scene import Scene

_FACTORIES = {
    "reach": "reach.models.analytic:make_reach",
    "reach-robust": "reach.models.analytic:make_reach_robust",
    "point": "reach.models.analytic:make_point",
    "point-robust": "reach.models.analytic:make_point_robust",
    "ellipse": "reach.models.analytic:make_ellipse",
    "ellipse-robust": "reach.models.analytic:make_ellipse_robust",
    "settled": "reach.models.settled:make_settled",
    "settled-robust": "reach.models.settled:make_settled_robust",
    "dynamic": "reach.models.dynamic:make_dynamic",
}


@dataclass(frozen=True, slots=True)
class Score:
    """A model's prediction for one grasp.

    Attributes:
        value: predicted chance of success, in [0, 1].
        seconds: computing time.
        details: what stands behind it; values are numbers, strings, or mappings of those.
    """

    value: float
    seconds: float
    details: dict[str, Any] = field(default_factory=dict)


class Scorer(Protocol):
    """A model with its parameters, ready to score."""

    @property
    def name(self) -> str:
        """One of MODEL_NAMES."""
        ...

    @property
    def version(self) -> str:
        """Changes whenever the scores may change."""
        ...

    @property
    def parameters(self) -> dict[str, float | bool | str]:
        """All that the scores depend on, for the record."""
        ...

    def score(
        self, scene: Scene, grasp: Grasp, *, pose_error: PoseError | None = None, seed: int = 0
    ) -> Score:
        """Score one grasp; a robust model uses its default pose error if none is given."""
        ...

    def score_many(
        self,
        scene: Scene,
        grasps: Sequence[Grasp],
        *,
        pose_error: PoseError | None = None,
        seed: int = 0,
        progress: Callable[[int], None] | None = None,
    ) -> list[Score]:
        """Score many grasps on one part, telling `progress` how many are done."""
        ...


def make_scorer(name: str, **overrides: Any) -> Scorer:
    """Make a scorer by name.

    Args:
        name: one of MODEL_NAMES.
        overrides: parameters that differ from the defaults.

    Raises:
        UnknownNameError: no model has this name.
        InvalidInputError: the model has no such parameter, or refuses its value.
    """
    if name not in _FACTORIES:
        raise UnknownNameError("model", name, MODEL_NAMES)
    module, _, function = _FACTORIES[name].partition(":")
    try:
        factory = getattr(importlib.import_module(module), function)
    except ImportError as error:
        raise InvalidInputError(
            f"model {name!r} cannot be used in this installation: {error}"
        ) from error
    try:
        scorer: Scorer = factory(**overrides)
    except TypeError as error:
        raise InvalidInputError(f"model {name!r} does not take {overrides!r}: {error}") from error
    return scorer


def warm_up(scorer: Scorer, scene: Scene, grasp: Grasp) -> None:
    """Judge a grasp once for nothing, so that the next score's time is a grasp's alone.

    Compiles or loads the kernels and prepares the part. A scorer without a contact model (dynamic)
    has none, and nothing is done.
    """
    from reach.models.base import ContactModel

    model = getattr(scorer, "model", None)
    if isinstance(model, ContactModel):
        model.evaluate(scene, grasp)
