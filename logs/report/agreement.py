"""How far two operators agree, as the report shows it."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class OperatorAgreement:
    """Blind verdicts of a first and a second operator on the same trials.

    Args:
        trials: how many both judged blindly.
        agreed: on how many they agree.
        kappa: Cohen's kappa; None where chance alone would agree always.
    """

    trials: int
    agreed: int
    kappa: float | None
