"""Cohen's kappa against scikit-learn, and whose verdicts count for it."""

from __future__ import annotations

import random
from typing import Any

import pytest

from labeling.agreement import (
    FEWEST_TRIALS,
    Agreement,
    cohen_kappa,
    describe,
    kappa_interval,
    operator_agreement,
)
from labeling.control.commands import Actor
from logs.journal.events import Source
from logs.journal.state import SessionState

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


def test_an_operator_does_not_agree_with_themselves(bench: Any) -> None:
    bench.labelled("success")
    bench.do("second_label", 1, by=BO, outcome="failure", reason="missed")
    bench.do("relabel", 1, by=BO, outcome="failure", reason="missed")
    assert operator_agreement(bench.state).pairs == 0


def test_the_interval_is_as_wide_as_the_analytic_one() -> None:
    # Both margins are one half: kappa is 2 p - 1 to first order, p the share that agrees, binomial.
    counts = {("s", "s"): 80, ("s", "f"): 20, ("f", "s"): 20, ("f", "f"): 80}
    pairs = [pair for pair, count in counts.items() for _ in range(count)]
    assert cohen_kappa(pairs) == pytest.approx(0.6)
    low, high = kappa_interval([[pair] for pair in pairs])
    deviation = 2 * (0.8 * 0.2 / len(pairs)) ** 0.5
    assert (low, high) == pytest.approx((0.6 - 1.96 * deviation, 0.6 + 1.96 * deviation), abs=0.02)


def test_pairs_that_share_a_trial_are_no_further_evidence() -> None:
    pairs = [("s", "s")] * 12 + [("s", "f")] * 4 + [("f", "f")] * 12 + [("f", "s")] * 4
    alone = kappa_interval([[pair] for pair in pairs])
    twice = kappa_interval([[pair, pair] for pair in pairs])
    assert alone == pytest.approx(twice)


def test_no_interval_where_the_verdicts_cannot_tell_one() -> None:
    mixed = [("s", "s"), ("f", "f"), ("s", "f"), ("f", "f")]
    assert kappa_interval([[pair] for pair in mixed[: FEWEST_TRIALS - 1]]) is None
    assert kappa_interval([[("s", "s")], [("f", "f")]] * 10) is None  # all agree: 1 in every draw
    lonely = [[("s", "s")]] * 19 + [[("s", "f")]]
    assert kappa_interval(lonely) is None  # every third draw lacks the one that differs
    assert kappa_interval([]) is None


def test_the_sentence_says_why_there_is_no_number() -> None:
    nothing = operator_agreement(SessionState([]))
    assert "undefined: no trial was judged blindly by two operators" in describe(nothing)
    same = Agreement(3, 3, 3, None, undefined="every verdict says success")
    assert "3 of 3 pairs" in describe(same) and "every verdict says success" in describe(same)
    assert "[0.100, 0.900] (95 %, bootstrap" in describe(Agreement(9, 8, 7, 0.5, (0.1, 0.9)))


def test_all_verdicts_the_same_leave_kappa_undefined_and_say_so(bench: Any) -> None:
    for number in (1, 2):
        bench.labelled("success")
        bench.do("second_label", number, by=BO, outcome="success")
    found = operator_agreement(bench.state)
    assert (found.agreed, found.kappa, found.undefined) == (2, None, "every verdict says success")
