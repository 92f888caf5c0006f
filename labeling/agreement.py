"""How far two operators agree beyond chance."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from logs.state import SessionState


@dataclass(frozen=True, slots=True)
class Agreement:
    """Agreement of the first and second operator's blind verdicts.

    Args:
        trials: how many trials both judged blindly.
        agreed: on how many they agree.
        kappa: Cohen's kappa; None if it is undefined (no trials, or both always say the same
            one thing).
    """

    trials: int
    agreed: int
    kappa: float | None


def cohen_kappa(pairs: Iterable[tuple[str, str]]) -> float | None:
    """Agreement beyond chance of two raters.

    Source: [Cohen1960] A coefficient of agreement for nominal scales, Eq. (1).

    Args:
        pairs: the two raters' answers per item.

    Returns:
        At most 1; 0 is chance; None if chance alone would agree always.
    """
    answers = list(pairs)
    if not answers:
        return None
    total = len(answers)
    observed = sum(first == second for first, second in answers) / total
    names = {name for pair in answers for name in pair}
    expected = sum(
        (sum(first == name for first, _ in answers) / total)
        * (sum(second == name for _, second in answers) / total)
        for name in names
    )
    if expected == 1:
        return None
    return (observed - expected) / (1 - expected)


def operator_agreement(state: SessionState) -> Agreement:
    """Agreement over all trials that a second operator judged blindly."""
    return joint_agreement([state])


def joint_agreement(states: Iterable[SessionState]) -> Agreement:
    """The same over several sessions together."""
    pairs = [pair for state in states for pair in _blind_pairs(state)]
    agreed = sum(first == second for first, second in pairs)
    return Agreement(len(pairs), agreed, cohen_kappa(pairs))


def _blind_pairs(state: SessionState) -> list[tuple[str, str]]:
    pairs: list[tuple[str, str]] = []
    for trial in state.trials.values():
        take = trial.valid_take
        first = take.blind_label if take else None
        if take is None or first is None:
            continue
        pairs += [
            (first.outcome.value, second.outcome.value)
            for second in take.second_labels.values()
            if second.blind and second.source is first.source
        ]
    return pairs
