"""Real-time tools: absolute deadlines, an undisturbed process, and histograms of times."""

from __future__ import annotations

import bisect
import gc
import itertools
import os
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import field
from typing import Final

from ..envs.errors import ConfigurationError
from ..envs.settings import configuration


class Pace:
    """Absolute deadlines of periods: no delay adds up.

    A period that should have begun and ended while an earlier one took too long is skipped, never made up.

    Args:
        rate: Periods a second.
        clock: Nanoseconds now.

    Attributes:
        overrun: Periods that were not over when the next should have begun.
        skipped: Skipped periods.
    """

    def __init__(self, rate: int, clock: Callable[[], int] = time.perf_counter_ns) -> None:
        self._rate, self._clock = rate, clock
        self._begin, self._next = clock(), 0
        self.overrun = self.skipped = 0

    @property
    def deadline(self) -> int:
        """When the next period begins, ns; exact for ever, as no step is added up."""
        return self._begin + self._next * 1_000_000_000 // self._rate

    def done(self) -> None:
        """End a period: go on to the next one that is not over."""
        self._next += 1
        now = self._clock()
        if now <= self.deadline:
            return
        self.overrun += 1
        begun = max((now - self._begin) * self._rate // 1_000_000_000, self._next)
        self.skipped += begun - self._next
        self._next = begun


@contextmanager
def undisturbed(cpu: int | None = None, priority: int | None = None) -> Iterator[None]:
    """Without garbage collection; on one core and with real-time priority, where requested.

    Core and priority are given back at the end: logs are written as by any other program.

    Args:
        cpu: Number of the core.
        priority: Of SCHED_FIFO, 1 to 99.

    Raises:
        ConfigurationError: the system refuses.
    """
    with ExitStack() as after:
        try:
            if cpu is not None:
                cores = os.sched_getaffinity(0)
                os.sched_setaffinity(0, {cpu})
                after.callback(os.sched_setaffinity, 0, cores)
            if priority is not None:
                policy, level = os.sched_getscheduler(0), os.sched_getparam(0)
                os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(priority))
                after.callback(os.sched_setscheduler, 0, policy, level)
        except (AttributeError, OSError, OverflowError) as error:
            raise ConfigurationError(
                f"the system refuses --cpu {cpu} or --priority {priority} ({error}); leave it out, or run as "
                "one who may"
            ) from None
        gc.collect()
        gc.freeze()
        after.callback(gc.unfreeze)
        gc.disable()
        after.callback(gc.enable)
        yield


QUANTILES: Final = {"p50": 0.5, "p90": 0.9, "p99": 0.99, "p99_9": 0.999}
"""Shares of a summary by name."""


@configuration
class TimingSummary:
    """Summary of a histogram, s; None where nothing was counted.

    Args:
        count: Number of times.
        mean: Of all.
        p50: Median, to within 3 %.
        p90: 90th percentile, likewise.
        p99: 99th percentile, likewise.
        p99_9: 99.9th percentile, likewise.
        max: The longest, exact.
        buckets: [longest time, s; count] of each bucket that is not empty.
    """

    count: int
    mean: float | None = None
    p50: float | None = None
    p90: float | None = None
    p99: float | None = None
    p99_9: float | None = None
    max: float | None = None
    buckets: tuple[tuple[float, int], ...] = field(default=())


class Histogram:
    """Histogram of times in constant memory: a bucket is at most 1/32 of its times wide, as HdrHistogram's.

    The package hdrhistogram 0.10.8 does not replace it. It takes 2.3 us a value instead of 1.4, knows mean
    and maximum only to a bucket, ignores values out of its range, and needs setuptools and pbr at run time.
    It has no wheel for Linux on ARM: a compiler is needed there.
    """

    def __init__(self) -> None:
        self._counts: dict[int, int] = {}
        self._sum = self._max = 0

    def add(self, nanoseconds: int) -> None:
        """Count a time; a negative one as zero."""
        value = max(nanoseconds, 0)
        # A bucket is named by its longest time: the six highest bits of its times, all bits below them set.
        bucket = value | ((1 << max(value.bit_length() - 6, 0)) - 1)
        self._counts[bucket] = self._counts.get(bucket, 0) + 1
        self._sum += value
        self._max = max(self._max, value)

    def summary(self) -> TimingSummary:
        """In seconds."""
        if not self._counts:
            return TimingSummary(0)
        buckets = sorted(self._counts.items())
        below = list(itertools.accumulate(count for _, count in buckets))
        total = below[-1]
        quantiles = {
            name: 1e-9 * min(buckets[bisect.bisect_left(below, share * total)][0], self._max)
            for name, share in QUANTILES.items()
        }
        return TimingSummary(
            total,
            1e-9 * self._sum / total,
            **quantiles,
            max=1e-9 * self._max,
            buckets=tuple((1e-9 * bucket, count) for bucket, count in buckets),
        )
