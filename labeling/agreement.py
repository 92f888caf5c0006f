"""How far two operators agree beyond chance."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from logs.journal.state import SessionState, TrialState


@dataclass(frozen=True, slots=True)
class Agreement:
    """Agreement of the first and second operators' blind verdicts.

    A pair is a first operator's blind verdict on a trial and another operator's on the same one: a
    trial that two others judged again counts as two pairs.

    Args:
        pairs: how many pairs there are.
        trials: on how many trials.
        agreed: how many pairs agree.
        kappa: Cohen's kappa of the pairs; None if it is undefined (no pairs, or all verdicts say
            the same one thing).
    """

    pairs: int
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
    trials = [pairs for state in states for t in state.trials.values() if (pairs := _pairs(t))]
    pairs = [pair for of_trial in trials for pair in of_trial]
    agreed = sum(first == second for first, second in pairs)
    return Agreement(len(pairs), len(trials), agreed, cohen_kappa(pairs))


def _pairs(trial: TrialState) -> list[tuple[str, str]]:
    """The blind pairs of one trial, one for each further operator."""
    take = trial.valid_take
    first = take.blind_label if take else None
    if take is None or first is None:
        return []
    return [
        (first.outcome.value, second.outcome.value)
        for second in take.second_labels.values()
        if second.blind and second.source is first.source
    ]
