"""Cohen's kappa against scikit-learn, and whose verdicts count for it."""

from __future__ import annotations

import random
from typing import Any

import pytest

from labeling.agreement import cohen_kappa, operator_agreement
from labeling.commands import Actor
from logs.journal.events import Source

BO = Actor("bo", Source.OPERATOR)
CY = Actor("cy", Source.OPERATOR)


def test_kappa_matches_scikit_learn() -> None:
    metrics = pytest.importorskip("sklearn.metrics")
    rng = random.Random(3)
    for _ in range(20):
        first = [rng.choice("sf") for _ in range(40)]
        second = [value if rng.random() < 0.8 else rng.choice("sf") for value in first]
        expected = metrics.cohen_kappa_score(first, second)
        assert cohen_kappa(zip(first, second, strict=True)) == pytest.approx(expected)


def test_kappa_is_undefined_without_trials_or_without_variety() -> None:
    assert cohen_kappa([]) is None
    assert cohen_kappa([("s", "s")] * 5) is None


def test_perfect_agreement_is_one_and_opposition_is_negative() -> None:
    assert cohen_kappa([("s", "s"), ("f", "f")]) == 1
    assert cohen_kappa([("s", "f"), ("f", "s")]) == -1


def test_only_blind_second_verdicts_count(bench: Any) -> None:
    bench.labelled("success")
    bench.labelled("failure", reason="missed")
    bench.do("second_label", 1, by=BO, outcome="success")
    found = operator_agreement(bench.state)
    assert (found.trials, found.agreed) == (1, 1)
    bench.do("second_label", 2, by=BO, outcome="success")
    found = operator_agreement(bench.state)
    assert (found.trials, found.agreed, found.kappa) == (2, 1, 0.0)


def test_a_trial_that_three_operators_judged_is_one_trial_and_two_pairs(bench: Any) -> None:
    bench.labelled("success")
    bench.do("second_label", 1, by=BO, outcome="success")
    bench.do("second_label", 1, by=CY, outcome="failure", reason="missed")
    found = operator_agreement(bench.state)
    assert (found.pairs, found.trials, found.agreed) == (2, 1, 1)
