"""Statistics over drives, against computations of other kinds."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import mannwhitneyu, norm

from motion_cueing.evaluation.benchmark.statistics import (
    FEWEST,
    difference,
    estimate,
    improvement,
    profile,
    worst_tenth,
)

RANDOM = np.random.default_rng(4)
SAMPLE = RANDOM.lognormal(size=120)


def test_the_interval_of_a_mean_is_that_of_the_central_limit_theorem():
    found = estimate(SAMPLE)
    half = norm.ppf(0.975) * SAMPLE.std() / np.sqrt(len(SAMPLE))
    assert found.value == SAMPLE.mean()
    assert found.high - found.low == pytest.approx(2.0 * half, rel=0.08)
    assert found.low == pytest.approx(SAMPLE.mean() - half, abs=0.15 * half)


@pytest.mark.parametrize("statistic", [np.mean, np.median, worst_tenth])
def test_the_interval_is_that_of_a_bootstrap_by_a_loop(statistic):
    random = np.random.default_rng(99)
    values = [statistic(random.choice(SAMPLE, len(SAMPLE))) for _ in range(4000)]
    low, high = np.quantile(values, [0.025, 0.975])
    found = estimate(SAMPLE, statistic)
    assert (found.low, found.high) == pytest.approx((low, high), abs=0.12 * (high - low))


def test_nineteen_of_twenty_intervals_cover_the_true_mean():
    random = np.random.default_rng(5)
    covered = 0
    for _ in range(200):
        found = estimate(random.normal(3.0, 1.0, 40))
        covered += found.low <= 3.0 <= found.high
    # Of 200 trials with probability 0.95; 0.93 is what a percentile bootstrap of 40 has.
    assert 175 <= covered <= 199


def test_the_worst_tenth_is_the_mean_of_the_largest():
    values = RANDOM.permutation(np.arange(1.0, 26.0))
    assert worst_tenth(values) == 24.0
    assert worst_tenth(values[:1]) == values[0]
    assert list(worst_tenth(np.stack([values, -values]))) == [24.0, -2.0]


def test_few_drives_have_no_interval():
    few = estimate(SAMPLE[: FEWEST - 1])
    assert (few.low, few.high) == (None, None)
    assert estimate(SAMPLE[:FEWEST]).low is not None


def test_equal_values_have_an_interval_of_no_width():
    found = estimate(np.full(30, 2.0))
    assert (found.low, found.value, found.high) == (2.0, 2.0, 2.0)


def test_a_paired_interval_is_narrower_than_the_drives_differ_and_has_the_sign_of_the_better():
    hard = RANDOM.lognormal(sigma=2.0, size=60)
    better = hard - 0.1 - 0.02 * RANDOM.random(60)
    found = difference(better, hard)
    assert found.value == pytest.approx(np.mean(better - hard))
    assert found.low < found.value < found.high < 0.0
    worse = difference(hard, better)
    assert (worse.low, worse.high) == pytest.approx((-found.high, -found.low), abs=1e-3)
    assert worse.low > 0.0
    # Unpaired the intervals overlap.
    assert estimate(better).high > estimate(hard).low


def test_the_probability_of_improvement_is_that_of_mann_and_whitney_in_each_drive():
    mine, theirs = RANDOM.integers(0, 6, (3, 20)), RANDOM.integers(0, 6, (4, 20))
    expected = [
        1.0 - mannwhitneyu(mine[:, k], theirs[:, k], method="asymptotic").statistic / (3 * 4)
        for k in range(20)
    ]
    assert improvement(mine, theirs).value == pytest.approx(np.mean(expected))
    assert improvement(SAMPLE, SAMPLE).value == 0.5
    sure = improvement(SAMPLE - 1.0, SAMPLE)
    assert (sure.low, sure.value, sure.high) == (1.0, 1.0, 1.0)


def test_a_statistic_of_several_runs_is_the_mean_of_theirs():
    runs = RANDOM.lognormal(size=(3, 50))
    assert estimate(runs, np.median).value == pytest.approx(np.mean(np.median(runs, axis=1)))
    assert estimate(runs).low == pytest.approx(estimate(runs.mean(axis=0)).low)


def test_a_profile_counts_drives():
    thresholds = np.array([0.0, 0.5, 1.0, 2.0, 1e9])
    share, low, high = profile(SAMPLE, thresholds)
    assert list(share) == [np.count_nonzero(one >= SAMPLE) / len(SAMPLE) for one in thresholds]
    assert (np.diff(share) >= 0.0).all()
    assert (low <= share).all()
    assert (share <= high).all()
    assert (high[1:4] - low[1:4] > 0.05).all()
    runs = np.stack([SAMPLE, 2.0 * SAMPLE])
    expected = 0.5 * (np.mean(SAMPLE <= 1.0) + np.mean(SAMPLE <= 0.5))
    assert profile(runs, np.array([1.0]))[0][0] == pytest.approx(expected)
