"""Metrics against scikit-learn, against numbers computed by hand, and at their known limits."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from sklearn.metrics import average_precision_score, brier_score_loss, recall_score

from reach.arrays import frozen
from reach.evaluation import metrics
from reach.evaluation.bootstrap import (
    bootstrap,
    difference_intervals,
    interval,
    interval_note,
    intervals,
)
from reach.evaluation.cases import ObjectOutcomes, Outcomes
from reach.evaluation.gains import gains
from reach.evaluation.table import mean_metrics


def outcomes(successes, trials, name="part"):
    return ObjectOutcomes(name, frozen(successes, np.int64), frozen(trials, np.int64))


def samples(one, scores):
    """One row a trial: labels and scores, as scikit-learn wants them."""
    labels = np.concatenate(
        [np.r_[np.ones(s), np.zeros(t - s)] for s, t in zip(one.successes, one.trials, strict=True)]
    )
    return labels, np.repeat(scores, one.trials)


grasps = st.lists(
    st.tuples(st.integers(0, 5), st.integers(0, 5), st.sampled_from(np.linspace(0, 1, 21))),
    min_size=1,
    max_size=30,
).filter(lambda rows: any(s for s, _, _ in rows) and any(s + f for s, f, _ in rows))


@settings(deadline=None, max_examples=200)
@given(grasps)
def test_agrees_with_scikit_learn(rows):
    rows = [(s, s + f, score) for s, f, score in rows if s + f]
    one = outcomes([r[0] for r in rows], [r[1] for r in rows])
    scores = np.array([r[2] for r in rows])
    labels, repeated = samples(one, scores)
    assert metrics.average_precision(one, scores)[0] == pytest.approx(
        average_precision_score(labels, repeated)
    )
    recalls = [
        recall_score(labels, repeated >= k / 10 - 1e-9, zero_division=0.0) for k in range(11)
    ]
    assert metrics.average_recall(one, scores)[0] == pytest.approx(np.mean(recalls))
    assert metrics.brier(one, scores)[0] == pytest.approx(
        brier_score_loss(labels, repeated, pos_label=1)
    )


def test_by_hand():
    # Scores .9 (5 of 5), .5 (3 of 5), .2 (0 of 5): 8 positives among 15 samples.
    one = outcomes([5, 3, 0], [5, 5, 5])
    scores = np.array([0.9, 0.5, 0.2])
    # Steps of recall 5/8 at precision 1 and 3/8 at precision 8/10.
    assert metrics.average_precision(one, scores)[0] == pytest.approx(5 / 8 + 3 / 8 * 0.8)
    # Score .9 passes ten of the eleven thresholds, .5 passes six.
    assert metrics.average_recall(one, scores)[0] == pytest.approx((5 * 10 + 3 * 6) / (8 * 11))
    assert metrics.mean_absolute_error(one, scores)[0] == pytest.approx((0.1 + 0.1 + 0.2) / 3)
    expected = (5 * 0.01 + 3 * 0.25 + 2 * 0.25 + 5 * 0.04) / 15
    assert metrics.brier(one, scores)[0] == pytest.approx(expected)
    assert metrics.f1(np.array(0.8), np.array(0.4)) == pytest.approx(2 * 0.32 / 1.2)


def test_a_share_equal_to_a_threshold_passes_it():
    one = outcomes([1], [1])
    assert metrics.average_recall(one, np.array([3 * 0.1]))[0] == pytest.approx(4 / 11)
    assert metrics.average_recall(one, np.array([0.7]))[0] == pytest.approx(8 / 11)


def test_perfect_constant_and_inverted_scores():
    one = outcomes([5, 0, 5, 0], [5, 5, 5, 5])
    perfect = one.rates
    for metric, value in [
        (metrics.average_precision, 1.0),
        (metrics.average_recall, 1.0),
        (metrics.mean_absolute_error, 0.0),
        (metrics.brier, 0.0),
    ]:
        assert metric(one, perfect)[0] == value
    constant = np.ones(4)
    assert metrics.average_precision(one, constant)[0] == 0.5  # the share of positives
    assert metrics.average_recall(one, constant)[0] == 1.0
    assert metrics.mean_absolute_error(one, constant)[0] == 0.5
    assert metrics.average_recall(one, 1 - perfect)[0] == pytest.approx(1 / 11)


def test_ties_do_not_depend_on_order():
    scores = np.array([0.5, 0.5, 0.5])
    values = {
        float(metrics.average_precision(outcomes(order, [5, 5, 5]), scores)[0])
        for order in ([5, 0, 0], [0, 5, 0], [0, 0, 5])
    }
    assert values == {1 / 3}


def test_object_without_a_positive_has_no_ap_or_ar():
    one = outcomes([0, 0], [5, 5])
    assert np.isnan(metrics.average_precision(one, np.array([0.3, 0.9]))[0])
    assert np.isnan(metrics.average_recall(one, np.array([0.3, 0.9]))[0])
    assert metrics.mean_absolute_error(one, np.array([0.3, 0.9]))[0] == pytest.approx(0.6)
    two = Outcomes((one, outcomes([5], [5], "other")), (np.array([0, 1]), np.array([2])))
    assert two.without_positive == ("part",)


def test_weights_mean_repetition():
    one = outcomes([5, 3, 0], [5, 5, 5])
    scores = np.array([0.9, 0.5, 0.2])
    weighted = np.array([[2.0, 0.0, 1.0], [1.0, 1.0, 1.0]])
    repeated, scores_repeated = outcomes([5, 5, 0], [5, 5, 5]), np.array([0.9, 0.9, 0.2])
    for metric in (
        metrics.average_precision,
        metrics.average_recall,
        metrics.mean_absolute_error,
        metrics.brier,
    ):
        values = metric(one, scores, weighted)
        assert values[0] == pytest.approx(metric(repeated, scores_repeated)[0])
        assert values[1] == pytest.approx(metric(one, scores)[0])


def test_majority_is_one_label_a_grasp_and_a_tie_is_no_majority():
    one = outcomes([5, 3, 2, 1], [5, 5, 5, 2]).majority()
    np.testing.assert_array_equal(one.successes, [1, 1, 0, 0])
    np.testing.assert_array_equal(one.trials, [1, 1, 1, 1])


def test_precision_recall_points():
    precision, recall, threshold = metrics.precision_recall(
        outcomes([5, 3, 0], [5, 5, 5]), np.array([0.9, 0.5, 0.2])
    )
    np.testing.assert_allclose(precision, [1, 0.8, 8 / 15])
    np.testing.assert_allclose(recall, [5 / 8, 1, 1])
    np.testing.assert_allclose(threshold, [0.9, 0.5, 0.2])


def two_objects():
    a = outcomes([5, 4, 1, 0, 2, 5], [5] * 6, "a")
    b = outcomes([0, 1, 5, 5, 3, 0], [5] * 6, "b")
    return Outcomes((a, b), (np.arange(6), np.arange(6, 12)))


def test_bootstrap_is_seeded_and_brackets_the_estimate():
    both = two_objects()
    rates = np.concatenate([one.rates for one in both.objects])
    scores = {"oracle": rates, "noisy": np.clip(rates + np.tile([0.3, -0.3], 6), 0, 1)}
    first = bootstrap(both, scores, np.random.default_rng(1), draws=500)
    again = bootstrap(both, scores, np.random.default_rng(1), draws=500)
    np.testing.assert_array_equal(first["noisy"]["ap"], again["noisy"]["ap"])
    low, high = interval(first["noisy"]["mae"], 8)
    assert low < np.mean(np.abs(scores["noisy"] - rates)) < high
    # Models share their draws: the oracle is never worse in any of them.
    assert np.all(first["oracle"]["mae"] <= first["noisy"]["mae"])
    assert np.all(first["oracle"]["mae"] == 0)


def test_bootstrap_spread_matches_the_two_stage_variance():
    # Two objects of constant difference: a draw's mean is one of three values, 1/4 1/2 1/4.
    a, b = outcomes([5] * 50, [5] * 50, "a"), outcomes([0] * 50, [5] * 50, "b")
    both = Outcomes((a, b), (np.arange(50), np.arange(50, 100)))
    drawn = bootstrap(both, {"one": np.ones(100)}, np.random.default_rng(0), draws=4000)
    values, counts = np.unique(drawn["one"]["mae"], return_counts=True)
    np.testing.assert_array_equal(values, [0, 0.5, 1])
    np.testing.assert_allclose(counts / 4000, [0.25, 0.5, 0.25], atol=0.03)
    # An object without a positive is left out of AP: the draws of b alone define none.
    assert np.isnan(drawn["one"]["ap"]).mean() == pytest.approx(0.25, abs=0.03)
    assert set(drawn["one"]["ap"][np.isfinite(drawn["one"]["ap"])]) == {1.0}
    assert interval(np.full(9, np.nan), 9) is None


def many(successes, trials, count):
    """The same grasps on several objects."""
    objects = tuple(outcomes(successes, trials, str(i)) for i in range(count))
    size = len(trials)
    return Outcomes(objects, tuple(np.arange(i * size, (i + 1) * size) for i in range(count)))


def bounds(some, scores, exact=()):
    drawn = bootstrap(some, {"one": scores}, np.random.default_rng(0), 400)
    return intervals(some, drawn["one"], exact)


def test_too_few_objects_have_no_interval():
    """However many grasps there are: how objects scatter is not known from four."""
    four, five = (many([5, 0, 3, 1] * 5, [5] * 20, count) for count in (4, 5))
    assert set(bounds(four, np.tile(four.objects[0].rates, 4)).values()) == {None}
    assert "too few objects (4 with a success, it takes 5)" in interval_note(four)
    assert None not in bounds(five, np.linspace(0, 1, 100)).values()
    assert "(5)" in interval_note(five)


def test_only_objects_that_define_a_metric_count():
    """Six objects, two of them never lifted: AP and AR are means over four."""
    lost = tuple(outcomes([0, 0], [5, 5], f"lost {i}") for i in range(2))
    rest = many([5, 2], [5, 5], 4)
    everything = Outcomes(rest.objects + lost, tuple(np.arange(2 * i, 2 * i + 2) for i in range(6)))
    found = bounds(everything, np.tile([0.9, 0.3], 6))
    assert found["ap"] is found["ar"] is found["f1"] is None
    assert found["mae"] and found["brier"]


def test_a_perfect_row_is_not_certain():
    """Twelve objects ranked without a mistake: in up to 26 % of all objects there may be one."""
    perfect = many([5, 5, 0], [5, 5, 5], 12)
    found = bounds(perfect, np.tile([1.0, 0.8, 0.1], 12))
    low, high = found["ap"]
    assert high == 1.0
    assert low**12 == pytest.approx(0.025)  # Clopper and Pearson's bound, by its definition
    scores = np.tile([1.0, 1.0, 0.0], 12)
    assert bounds(perfect, scores)["mae"] == pytest.approx((0.0, 1.0 - low))
    assert bounds(perfect, scores, exact=("mae",))["mae"] is None  # the oracle's, by definition


def test_where_nothing_failed_average_precision_tells_nothing():
    lifted = many([5] * 5, [5] * 5, 6)
    found = bounds(lifted, np.linspace(0, 1, 30))
    assert found["ap"] is None and found["ar"] is not None
    assert "No trial failed" in interval_note(lifted)


def test_interval_of_few_objects_is_wider_than_their_percentiles():
    """Student's factor: of a normal sample of n values, percentiles reach t sqrt(n / (n - 1))."""
    drawn = np.random.default_rng(0).normal(0.5, 0.05, 400_000)
    low, high = interval(drawn, 6)
    expected = 0.05 * 2.5706 * np.sqrt(6 / 5)  # quantile .975 of t with 5 degrees of freedom
    assert (high - low) / 2 == pytest.approx(expected, rel=0.02)
    wide, narrow = interval(drawn, 5), interval(drawn, 500)
    assert wide[0] < low < narrow[0] < narrow[1] < high < wide[1]


@pytest.mark.parametrize("count", [5, 8])
def test_intervals_cover_the_truth(count):
    """In made-up experiments whose truth is known, at least as often as they say, nearly."""

    def experiment(rng, objects, grasps=12, repeats=3):
        level = rng.beta(4, 2, objects)[:, None]
        chance = rng.beta(3 * level, 3 * (1 - level), (objects, grasps))
        scores = np.clip(chance + rng.normal(0, 0.2, chance.shape), 0, 1)
        lifted = rng.binomial(repeats, chance)
        made = [outcomes(row, np.full(grasps, repeats), str(i)) for i, row in enumerate(lifted)]
        places = np.arange(objects * grasps).reshape(objects, grasps)
        return Outcomes(tuple(made), tuple(places)), scores.ravel()

    rng = np.random.default_rng(count)
    truth = mean_metrics(*experiment(rng, 3000))
    hits = {"ap": 0, "ar": 0, "mae": 0}
    for _ in range(60):
        made, scores = experiment(rng, count)
        drawn = bootstrap(made, {"one": scores}, rng, 300)
        found = intervals(made, drawn["one"])
        for key in hits:
            low, high = found[key]
            hits[key] += low <= truth[key] <= high
    assert all(hit >= 53 for hit in hits.values()), hits  # 95 % of 60 is 57; 53 or less: 3 in 100


def test_gain_is_paired_and_judged_as_the_paper_states_it():
    """A model that is the rival shifted on every grasp alike gains with no scatter at all."""
    everything = many([5, 3, 0], [5, 5, 5], 6)
    low = np.array([0.55, 0.35, 0.05] * 6)
    scores = {"reach": low + 0.2, "point": low}
    resampled = bootstrap(everything, scores, np.random.default_rng(0), 300)
    means = {name: mean_metrics(everything, values) for name, values in scores.items()}
    (gain,) = gains(everything, means, resampled)
    # Two thresholds more pass for every grasp: recall gains 2/11, the ranking is the same.
    assert gain.ar == pytest.approx(2 / 11) and gain.ap == pytest.approx(0)
    assert gain.ar_interval is None  # alike on all six objects: nothing is told of others
    assert gain.as_published is True and not gain.certain
    sure = replace(gain, ar_interval=(0.12, 0.3), ap_interval=(0.0, 0.1))
    assert sure.certain and not replace(sure, ar_interval=(0.1, 0.3)).certain
    (back,) = gains(everything, means, resampled, [("point", "reach")])
    assert back.as_published is False and back.ar == pytest.approx(-2 / 11)
    assert gains(everything, {"reach": means["reach"]}, resampled) == ()
    scores["point"] = low * np.repeat(np.linspace(0.5, 1.0, 6), 3)
    drawn = bootstrap(everything, scores, np.random.default_rng(0), 300)
    lower, upper = difference_intervals(everything, drawn["reach"], drawn["point"])["ar"]
    assert 0 < lower < np.mean(drawn["reach"]["ar"] - drawn["point"]["ar"]) < upper
