"""What an evaluation is run with, and all that is known of it afterwards, as plain values."""

from __future__ import annotations

import os
from collections import Counter
from collections.abc import Iterable
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from logs.dataset.dataset import Dataset
    from reach.evaluation.protocol import Protocol
    from reach.evaluation.table import Evaluation
    from reach.pose_error import PoseError


def evaluation_content(
    dataset: Dataset,
    result: Evaluation,
    pose_error: dict[str, Any],
    protocol: Protocol | None = None,
) -> dict[str, Any]:
    """The results as plain JSON values: what `--json` writes and every table is made from.

    Args:
        dataset: the labeled trials.
        result: how the models compare on them.
        pose_error: the one used, and where it is from.
        protocol: the cross-validation, if it was run.
    """
    content = {
        **result.to_json(),
        "pose_error": pose_error,
        "simulated": dataset.simulated,
        "cores": os.cpu_count(),
        "data": {
            "name": dataset.name,
            "origin": dataset.origin,
            "success_rule": dataset.success_rule,
            "left_out": _counted(row.reason for row in dataset.left_out),
            "reasons": _counted(
                trial.label.reason or "not said"
                for trial in dataset.trials
                if not trial.label.success
            ),
        },
    }
    return content if protocol is None else {**content, "cross_validation": protocol.to_json()}


def model_names(models: str) -> list[str]:
    """Names in a comma-separated list; `all` stands for every model.

    Raises:
        InvalidInputError: no name is given.
    """
    from reach.errors import InvalidInputError
    from reach.models.names import MODEL_NAMES

    if models == "all":
        return list(MODEL_NAMES)
    names = list(dict.fromkeys(name.strip() for name in models.split(",") if name.strip()))
    if not names:
        raise InvalidInputError(f"--models {models!r} names none; valid: {', '.join(MODEL_NAMES)}")
    return names


def chosen_pose_error(dataset: Dataset, given: str | None) -> tuple[PoseError, dict[str, Any]]:
    """The pose error to use, and where it is from."""
    from logs.errors import DatasetError
    from reach.pose_error import PoseError

    if given is not None:
        translation, rotation = _two_numbers(given)
        basis = "given with --pose-error"
    elif dataset.pose_error is not None:
        stated = dataset.pose_error
        translation, rotation, basis = stated.translation, stated.rotation, stated.basis
    else:
        raise DatasetError(
            f"{dataset.name!r} states no pose error; give one: --pose-error METERS,RADIANS"
        )
    error = PoseError.isotropic(translation=translation, rotation=rotation)
    return error, {"translation": translation, "rotation": rotation, "basis": basis}


def _two_numbers(text: str) -> tuple[float, float]:
    from reach.errors import InvalidInputError

    try:
        translation, rotation = (float(part) for part in text.split(","))
    except ValueError:
        raise InvalidInputError(
            f"--pose-error is {text!r}, expected METERS,RADIANS such as 0.001,0.003"
        ) from None
    return translation, rotation


def _counted(values: Iterable[str]) -> dict[str, int]:
    """Values with their counts, most frequent first, then by name."""
    return dict(sorted(Counter(values).items(), key=lambda item: (-item[1], item[0])))
