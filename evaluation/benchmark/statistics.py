"""Statistics over drives: means with bootstrap intervals, paired comparison, performance profiles.

They follow Agarwal et al., "Deep reinforcement learning at the edge of the statistical precipice" (NeurIPS
2021): intervals instead of points, probability of improvement, performance profiles. Their package
``rliable`` is not used: it needs arch, absl and seaborn for what ``scipy.stats.bootstrap`` does.

A drive is the unit that is resampled, for all policies alike. An interval says how much a figure depends on
which drives are in the split. Values are (runs, n): a run is one training seed of a policy. Statistics are
those of each run, averaged over the runs.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from ...envs.settings import configuration

Floats = NDArray[np.float64]
Statistic = Callable[..., Any]
"""Of an array along ``axis``."""

CONFIDENCE: Final = 0.95
RESAMPLES: Final = 2000
FEWEST: Final = 5
"""Drives that an interval needs; of fewer the bootstrap says nothing."""


@configuration
class Estimate:
    """A figure with its interval.

    Args:
        value: Of the drives.
        low: Lower end of the 95 % interval; None for fewer than five drives.
        high: Upper end.
    """

    value: float
    low: float | None = None
    high: float | None = None


def worst_tenth(values: Floats, axis: int = -1) -> Any:
    """Mean of the largest tenth of the values, at least of one."""
    values = np.moveaxis(np.asarray(values), axis, -1)
    count = math.ceil(values.shape[-1] / 10)
    return np.partition(values, -count, axis=-1)[..., -count:].mean(axis=-1)


def estimate(values: Floats, statistic: Statistic = np.mean) -> Estimate:
    """A statistic of drives, with its 95 % percentile bootstrap interval over them; the same in every call.

    Args:
        values: (n,) of one run, or (runs, n).
        statistic: Of the drives of a run.
    """
    runs = np.atleast_2d(values)

    def over_runs(*resampled: Floats, axis: int) -> Any:
        return np.mean([statistic(run, axis=axis) for run in resampled], axis=0)

    value = float(over_runs(*runs, axis=-1))
    if runs.shape[1] < FEWEST:
        return Estimate(value)
    low, high = _interval(tuple(runs), over_runs)
    return Estimate(value, float(low), float(high))


def _interval(data: tuple[Floats, ...], statistic: Statistic) -> tuple[Any, Any]:
    from scipy.stats import bootstrap

    found = bootstrap(
        data,
        statistic,
        paired=True,
        vectorized=True,
        axis=-1,
        n_resamples=RESAMPLES,
        confidence_level=CONFIDENCE,
        method="percentile",
        random_state=np.random.default_rng(0),
    ).confidence_interval
    return found.low, found.high


def difference(values: Floats, reference: Floats) -> Estimate:
    """Mean over drives of value less reference, each averaged over its runs: below 0 is better than it.

    The drives are paired, so that what is hard about a drive cancels out.

    Args:
        values: (runs, n) of a policy.
        reference: (runs, n) of the reference in the same drives.
    """
    return estimate(np.atleast_2d(values).mean(axis=0) - np.atleast_2d(reference).mean(axis=0))


def improvement(values: Floats, reference: Floats) -> Estimate:
    """Probability of improvement: that a policy is better than the reference in a drive; equal is half.

    Args:
        values: (runs, n) of a policy; lower is better.
        reference: (runs, n) of the reference in the same drives.
    """
    mine, theirs = np.atleast_2d(values)[:, None], np.atleast_2d(reference)[None]
    wins = (mine < theirs) + 0.5 * (mine == theirs)
    return estimate(wins.mean(axis=(0, 1)))


def profile(values: Floats, thresholds: Floats) -> tuple[Floats, Floats, Floats]:
    """Performance profile: the share of drives with a value up to each threshold, and its 95 % band.

    Args:
        values: (runs, n).
        thresholds: (k,).

    Returns:
        Share, lower and upper end, (k,) each. The band is that share where there are too few drives.
    """
    runs = np.atleast_2d(values)
    reached = tuple(np.asarray(run <= thresholds[:, None], dtype=np.float64) for run in runs)

    def share(*resampled: Floats, axis: int) -> Any:
        return np.mean([np.mean(run, axis=axis) for run in resampled], axis=0)

    found = np.asarray(share(*reached, axis=-1))
    if runs.shape[1] < FEWEST:
        return found, found, found
    low, high = _interval(reached, share)
    return found, np.asarray(low), np.asarray(high)
