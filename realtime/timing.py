"""Periods that begin at fixed times: deadlines are absolute, so that no delay adds up."""

from __future__ import annotations

import gc
import math
import os
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import field
from typing import Final

from ..envs.errors import ConfigurationError
from ..envs.settings import configuration


class Pace:
    """The times at which periods begin.

    What is paced never hurries: a period that should have begun and ended meanwhile is left out, and what is
    paced goes on where it was, later.

    Args:
        rate: Periods a second.
        clock: Nanoseconds now.

    Attributes:
        overrun: Periods that were not over when the next should have begun.
        skipped: Periods left out.
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
        """A period is over: go to the next that is not over."""
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
    """Without the garbage collector; on one core and with real-time priority, where asked for.

    Args:
        cpu: Number of the core.
        priority: Of SCHED_FIFO, 1 to 99.

    Raises:
        ConfigurationError: the system refuses.
    """
    with ExitStack() as after:
        try:
            _prefer(cpu, priority, after)
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


def _prefer(cpu: int | None, priority: int | None, after: ExitStack) -> None:
    """Take core and priority; ``after`` gives them back: logs are written as any other program writes."""
    if cpu is not None:
        cores = os.sched_getaffinity(0)
        os.sched_setaffinity(0, {cpu})
        after.callback(os.sched_setaffinity, 0, cores)
    if priority is not None:
        policy, level = os.sched_getscheduler(0), os.sched_getparam(0)
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(priority))
        after.callback(os.sched_setscheduler, 0, policy, level)


# Times in buckets that grow with the time, as HdrHistogram has them: constant memory, to 3 %.


_BITS: Final = 5
"""Of a time that are kept below its highest one: buckets are at most 1/32 of the time wide."""
_WIDTH: Final = 2**_BITS
QUANTILES: Final = {"p50": 0.5, "p90": 0.9, "p99": 0.99, "p99_9": 0.999}
"""Shares of a summary by name."""


@configuration
class TimingSummary:
    """What a histogram says, s; None where nothing was counted.

    Args:
        count: Times.
        mean: Of all.
        p50: Half of them are no longer, to within 3 %.
        p90: 90 % are no longer.
        p99: 99 % are no longer.
        p99_9: 99.9 % are no longer.
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
    """Counts times in nanoseconds."""

    def __init__(self) -> None:
        self._counts = [0] * (_WIDTH * 64)
        self._sum, self._count, self._max = 0, 0, 0

    def add(self, nanoseconds: int) -> None:
        """Count a time; a negative one as none."""
        value = max(nanoseconds, 0)
        self._counts[_bucket(value)] += 1
        self._sum += value
        self._count += 1
        self._max = max(self._max, value)

    def quantile(self, share: float) -> int:
        """The least bucket end, ns, that this share of the times does not exceed."""
        needed, seen = max(1, math.ceil(share * self._count)), 0
        for bucket, count in enumerate(self._counts):
            seen += count
            if seen >= needed:
                return min(_end(bucket), self._max)
        return 0

    def summary(self) -> TimingSummary:
        """In seconds."""
        if self._count == 0:
            return TimingSummary(0)
        quantiles = {name: 1e-9 * self.quantile(share) for name, share in QUANTILES.items()}
        buckets = tuple((1e-9 * _end(k), count) for k, count in enumerate(self._counts) if count)
        mean = 1e-9 * self._sum / self._count
        return TimingSummary(self._count, mean, **quantiles, max=1e-9 * self._max, buckets=buckets)


def _bucket(value: int) -> int:
    """Where a time is counted: the number of its highest bit, and the bits behind it."""
    shift = max(value.bit_length() - _BITS - 1, 0)
    return _WIDTH * shift + (value >> shift)


def _end(bucket: int) -> int:
    """The longest time that a bucket counts, ns."""
    shift = max(bucket // _WIDTH - 1, 0)
    return ((bucket - _WIDTH * shift + 1) << shift) - 1
