"""What a reader must know of a model before trusting its line in a table of simulated labels."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

_SETTLED = (
    "its rules were compared with, and the robust score's three numbers fitted to, other simulated "
    "grasps of the built-in parts in the same engine"
)
_OF_SIMULATED_LABELS: Mapping[str, str] = {
    "dynamic": "same engine as the labels: a ceiling, not a rival",
    "settled": _SETTLED,
    "settled-robust": _SETTLED,
}


def footnotes(models: Iterable[str], *, simulated: bool) -> dict[str, list[str]]:
    """Note -> the models it is about, of those given; none where robots made the labels."""
    notes: dict[str, list[str]] = {}
    for model in models:
        if simulated and model in _OF_SIMULATED_LABELS:
            notes.setdefault(_OF_SIMULATED_LABELS[model], []).append(model)
    return notes
