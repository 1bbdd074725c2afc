"""Deadlines, histograms, and the undisturbed process."""

from __future__ import annotations

import gc
import os

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from motion_cueing.envs.errors import ConfigurationError
from motion_cueing.realtime.timing import Histogram, Pace, TimingSummary, undisturbed

from .bench import Clock


@given(st.lists(st.integers(0, 10**13), min_size=1, max_size=200))
def test_quantiles_are_three_percent_exact(times):
    histogram = Histogram()
    for time in times:
        histogram.add(time)
    summary = histogram.summary()
    for name, percent in {"p50": 50, "p90": 90, "p99": 99, "p99_9": 99.9}.items():
        # The definition: the smallest of the times that this share of them does not exceed.
        exact = 1e-9 * np.percentile(times, percent, method="inverted_cdf")
        assert exact * (1.0 - 1e-12) <= getattr(summary, name) <= exact * (1.0 + 1.0 / 32.0) + 1e-15
    assert summary.count == len(times) == sum(count for _, count in summary.buckets)
    assert summary.max == pytest.approx(1e-9 * max(times))
    assert summary.mean == pytest.approx(1e-9 * np.mean(times))
    assert list(summary.buckets) == sorted(summary.buckets)


def test_nothing_counted_says_nothing():
    assert Histogram().summary() == TimingSummary(0)
    negative = Histogram()
    negative.add(-5)
    assert negative.summary().max == 0.0


def test_deadlines_do_not_drift_at_any_rate():
    clock = Clock()
    pace, begin = Pace(300, clock), clock.now
    for k in range(3000):
        assert pace.deadline == begin + k * 10**9 // 300
        clock.now = pace.deadline + 100
        pace.done()
    assert (pace.overrun, pace.skipped) == (0, 0)


@pytest.mark.parametrize(
    ("took", "overrun", "skipped", "following"),
    [(1.0, 0, 0, 1), (1.001, 1, 0, 1), (1.9, 1, 0, 1), (2.1, 1, 1, 2), (35.5, 1, 34, 35)],
)
def test_a_period_that_takes_too_long_is_told_and_never_made_up(took, overrun, skipped, following):
    clock = Clock()
    pace, begin = Pace(1000, clock), clock.now
    clock.now += round(took * 1e6)
    pace.done()
    assert (pace.overrun, pace.skipped) == (overrun, skipped)
    assert pace.deadline == begin + following * 10**6


def test_the_collector_rests_and_works_again():
    with undisturbed():
        assert not gc.isenabled()
    assert gc.isenabled()
    with pytest.raises(ConfigurationError, match="refuses --cpu 100000"), undisturbed(cpu=100000):
        pass
    assert gc.isenabled()


def test_core_and_priority_are_given_back(monkeypatch):
    """Also the core, where the priority that comes after it is refused."""
    cores, levels = os.sched_getaffinity(0), []
    monkeypatch.setattr(os, "sched_setscheduler", lambda *given: levels.append(given))
    with undisturbed(cpu=min(cores), priority=7):
        assert os.sched_getaffinity(0) == {min(cores)}
    assert os.sched_getaffinity(0) == cores
    assert [(policy, one.sched_priority) for _, policy, one in levels] == [
        (os.SCHED_FIFO, 7),
        (os.sched_getscheduler(0), os.sched_getparam(0).sched_priority),
    ]

    def refuse(*given):
        raise PermissionError("not you")

    monkeypatch.setattr(os, "sched_setscheduler", refuse)
    with pytest.raises(ConfigurationError, match="not you"), undisturbed(cpu=min(cores), priority=7):
        pass
    assert os.sched_getaffinity(0) == cores
