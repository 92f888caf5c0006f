"""How far two operators agree, as the report shows it."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class OperatorAgreement:
    """Blind verdicts of a first and a second operator on the same trials.

    Args:
        pairs: how many pairs of a first and a further operator's verdict there are.
        agreed: how many of them agree.
        kappa: Cohen's kappa; None where chance alone would agree always.
        interval: 95 % bootstrap interval of kappa over trials; None where it cannot be told.
    """

    pairs: int
    agreed: int
    kappa: float | None
    interval: tuple[float, float] | None = None
