"""What a reader must know of a model before trusting its line in a table of simulated labels."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

_SETTLED = (
    "its grade was fitted on trials of this engine and these parts (other grasps), its rules "
    "compared with them"
)
ORACLE = (
    "oracle knows each grasp's success rate: no score has a smaller MAE or Brier score here, but "
    "it bounds neither AR nor F1 (a constant 1 has an AR of 1)"
)
SHARED = (
    "The engine that made these labels and the settled model share assumptions: both press the "
    "pads' outlines as beds of independent springs, with stiffness from the same layer (modulus "
    "over thickness), both hold with Coulomb friction, and in both the part gives way as the "
    "jaws close. A robot need not share them: agreement of the two is no evidence for settled on "
    "a robot, nor is a low figure here evidence against a model that shares less."
)
_OF_SIMULATED_LABELS: Mapping[str, str] = {
    "dynamic": "same engine as the labels: a ceiling, not a rival",
    "settled": _SETTLED,
    "settled-robust": _SETTLED,
}


def shared_with_engine(models: Iterable[str], *, simulated: bool) -> str:
    """What settled has in common with the engine, where that matters to a table; else empty."""
    return SHARED if simulated and any(name.startswith("settled") for name in models) else ""


def footnotes(models: Iterable[str], *, simulated: bool) -> dict[str, list[str]]:
    """Note -> the models it is about, of those given; none where robots made the labels."""
    notes: dict[str, list[str]] = {}
    for model in models:
        if simulated and model in _OF_SIMULATED_LABELS:
            notes.setdefault(_OF_SIMULATED_LABELS[model], []).append(model)
    return notes
