"""How far two operators agree beyond chance, and how sure that is."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Final

from logs.journal.state import SessionState, TrialState

Pair = tuple[str, str]

DRAWS: Final = 2000
FEWEST_TRIALS: Final = 5
"""Below which the few trials, drawn again, are the same few and tell no scatter."""
LEAST_DEFINED: Final = 0.95
"""Share of the draws in which kappa must be defined for an interval to be stated."""


@dataclass(frozen=True, slots=True)
class Agreement:
    """Agreement of the first and further operators' blind verdicts.

    A pair is a first operator's blind verdict on a trial and another operator's on the same one: a
    trial that two others judged again counts as two pairs, and as one trial.

    Args:
        pairs: how many pairs there are.
        trials: on how many trials.
        agreed: how many pairs agree.
        kappa: Cohen's kappa of the pairs; None if it is undefined.
        interval: 95 % percentile interval of kappa, trials drawn with replacement together with
            all their pairs; None where these verdicts cannot tell it: fewer than 5 trials, no
            pair that disagrees (every draw would say 1), or too many draws without a kappa.
        undefined: why kappa is undefined, in words; empty if it is not.
    """

    pairs: int
    trials: int
    agreed: int
    kappa: float | None
    interval: tuple[float, float] | None = None
    undefined: str = ""


def cohen_kappa(pairs: Iterable[Pair]) -> float | None:
    """Agreement beyond chance of two raters.

    Source: [Cohen1960] A coefficient of agreement for nominal scales, Eq. (1).

    Args:
        pairs: the two raters' answers per item.

    Returns:
        At most 1; 0 is chance; None if there is no pair, or all answers are the same one: then
        chance alone would agree always.
    """
    answers = list(pairs)
    if not answers:
        return None
    total = len(answers)
    observed = sum(first == second for first, second in answers) / total
    firsts, seconds = (Counter(side) for side in zip(*answers, strict=True))
    expected = sum(firsts[name] * seconds[name] for name in firsts) / total**2
    if expected == 1:
        return None
    return (observed - expected) / (1 - expected)


def kappa_interval(
    trials: Sequence[Sequence[Pair]], *, seed: int = 0
) -> tuple[float, float] | None:
    """95 % bootstrap interval of kappa, as [Agreement][labeling.agreement.Agreement] states it.

    Pairs of one trial share its first verdict and are drawn together.

    Args:
        trials: the pairs of each trial.
        seed: of the draws.
    """
    import numpy as np

    pairs = [pair for of_trial in trials for pair in of_trial]
    if len(trials) < FEWEST_TRIALS or all(first == second for first, second in pairs):
        return None
    names = sorted({name for pair in pairs for name in pair})
    cells = np.zeros((len(trials), len(names), len(names)))
    for place, of_trial in enumerate(trials):
        for first, second in of_trial:
            cells[place, names.index(first), names.index(second)] += 1
    rng = np.random.default_rng(seed)
    weights = rng.multinomial(len(trials), np.full(len(trials), 1 / len(trials)), size=DRAWS)
    tables = np.tensordot(weights, cells, axes=1)  # (DRAWS, names, names)
    tables /= tables.sum(axis=(1, 2), keepdims=True)
    observed = np.trace(tables, axis1=1, axis2=2)
    expected = (tables.sum(axis=2) * tables.sum(axis=1)).sum(axis=1)
    defined = expected < 1 - 1e-12
    if defined.mean() < LEAST_DEFINED:
        return None
    kappas = (observed[defined] - expected[defined]) / (1 - expected[defined])
    low, high = np.percentile(kappas, [2.5, 97.5])
    return float(low), float(high)


def operator_agreement(state: SessionState) -> Agreement:
    """Agreement over all trials that a second operator judged blindly."""
    return joint_agreement([state])


def joint_agreement(states: Iterable[SessionState]) -> Agreement:
    """The same over several sessions together."""
    trials = [pairs for state in states for t in state.trials.values() if (pairs := _pairs(t))]
    pairs = [pair for of_trial in trials for pair in of_trial]
    return Agreement(
        pairs=len(pairs),
        trials=len(trials),
        agreed=sum(first == second for first, second in pairs),
        kappa=cohen_kappa(pairs),
        interval=kappa_interval(trials),
        undefined=_why_undefined(pairs),
    )


def describe(found: Agreement) -> str:
    """One sentence for a person."""
    counted = (
        f"{found.agreed} of {found.pairs} pairs of blind verdicts on {found.trials} trials agree"
    )
    if found.kappa is None:
        return f"{counted}, Cohen's kappa is undefined: {found.undefined}"
    if found.interval is None:
        return f"{counted}, Cohen's kappa {found.kappa:.3f} (too little to tell an interval)"
    low, high = found.interval
    return (
        f"{counted}, Cohen's kappa {found.kappa:.3f}"
        f" [{low:.3f}, {high:.3f}] (95 %, bootstrap over trials)"
    )


def _why_undefined(pairs: Sequence[Pair]) -> str:
    if not pairs:
        return "no trial was judged blindly by two operators"
    given = {name for pair in pairs for name in pair}
    return f"every verdict says {given.pop()}" if len(given) == 1 else ""


def _pairs(trial: TrialState) -> list[Pair]:
    """The blind pairs of one trial, one for each further operator."""
    take = trial.valid_take
    first = take.blind_label if take else None
    if take is None or first is None:
        return []
    return [
        (first.outcome.value, second.outcome.value)
        for second in take.second_labels.values()
        if second.blind and second.source is first.source and second.operator != first.operator
    ]
