"""The summary: means, intervals over drives, and their words."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from motion_cueing.evaluation.metrics import measure
from motion_cueing.evaluation.reporting.summary import chart, resampled_means, sentences, summarize
from motion_cueing.evaluation.results import Results

from ..examples import GAINS, ORIGIN, results_of
from ..synthetic import drive


def results_with(errors: dict[str, list[float]]) -> Results:
    """Results of policies with these J on drives of equal number."""
    metrics = measure(drive())
    count = len(next(iter(errors.values())))
    return Results.of(
        {
            f"drive {i}": {
                name: dataclasses.replace(metrics, cue_error=values[i]) for name, values in errors.items()
            }
            for i in range(count)
        },
        [],
        ORIGIN,
    )


def test_the_interval_of_many_drives_is_that_of_the_normal_distribution():
    values = np.random.default_rng(1).normal(3.0, 0.5, size=(100, 1))
    low, high = np.percentile(resampled_means(values), [2.5, 97.5])
    half = 1.96 * values.std(ddof=1) / np.sqrt(len(values))
    assert (low, high) == pytest.approx((values.mean() - half, values.mean() + half), abs=0.05 * half)


def test_policies_are_compared_over_the_same_drives():
    """A policy that is always 10 % better is surely better, however the drives differ."""
    worse = np.array([1.0, 50.0, 3.0, 700.0, 9.0])
    best, second = summarize(results_with({"best": (0.9 * worse).tolist(), "second": worse.tolist()}))
    assert best.error.low < best.error.value < best.error.high
    assert second.excess.value == pytest.approx(0.1)
    assert (second.excess.low, second.excess.high) == pytest.approx((0.1, 0.1))


def test_two_drives_have_no_interval():
    summaries = summarize(results_of(GAINS))
    assert all(summary.error.low is None for summary in summaries)
    assert "confidence" not in " ".join(sentences(summaries, 2))


def test_the_words_name_best_interval_and_cost():
    summaries = summarize(results_with({"a": [1.0, 2.0, 3.0], "no-motion": [4.0, 8.0, 12.0]}))
    text = sentences(summaries, 3)
    assert text[0].startswith(
        "a is best: mean J = 2.00 over 3 drives (95 % confidence interval over drives: "
    )
    assert text[1] == "Its mean J is 75 % lower than that of no-motion (75 to 75 %)."
    assert text[2] == "It takes 20 µs a step on average, and 20 µs at most."


def test_a_lead_that_other_drives_may_turn_is_said_to_be_one():
    summaries = summarize(results_with({"a": [1.0, 2.0, 3.0], "b": [1.1, 1.9, 3.2]}))
    assert sentences(summaries, 3)[1].endswith("over so few drives, either may be the better one.")


def test_the_chart_is_in_order_and_within_its_width():
    drawn = chart(summarize(results_with({"a": [1.0, 2.0, 3.0], "b": [10.0, 20.0, 900.0]})))
    for low, middle, high in drawn.points:
        assert 0.0 <= low <= middle <= high <= 100.0
    assert drawn.points[0][1] < drawn.points[1][1]
    assert {text for _, text in drawn.marks} >= {"1", "10", "100"}


def test_nothing_driven_has_no_summary():
    assert summarize(Results.of({}, [], ORIGIN)) == []
    assert sentences([], 0) == []
    assert chart([]).points == []
