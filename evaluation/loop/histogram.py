"""Times in buckets that grow with the time, as HdrHistogram has them: constant memory, to 3 %."""

from __future__ import annotations

import math
from dataclasses import field
from typing import Final

from ...envs.settings import configuration

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
