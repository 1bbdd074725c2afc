"""What a network does to packets: loses, repeats, delays and breaks some; drawn from a seed."""

from __future__ import annotations

import heapq
import math
from collections.abc import Iterator

import numpy as np

from ...envs.errors import ConfigurationError
from .packets import Cues

_DELAYS = (0.0005, 0.05)
"""Shortest and longest delay of a late packet, s."""


class Trouble:
    """Turns the cues that should be sent into what is sent, and when.

    Args:
        drop: Share of the packets that are lost.
        repeat: Share that comes twice.
        late: Share that comes up to 50 ms later than it should.
        nan: Share with a NaN in it.
        seed: Of the draws.
    """

    def __init__(self, drop: float, repeat: float, late: float, nan: float, seed: int) -> None:
        for name, share in {"drop": drop, "repeat": repeat, "late": late, "nan": nan}.items():
            if not 0.0 <= share <= 1.0:
                raise ConfigurationError(f"--{name} must be a share from 0 to 1, found {share:g}")
        self._drop, self._repeat, self._late, self._nan = drop, repeat, late, nan
        self._random = np.random.default_rng(seed)
        self._held: list[tuple[float, int, Cues]] = []

    def sent(self, cues: Cues, now: float) -> Iterator[Cues]:
        """What goes out now, s: the cues, unless something happens to them, and those that were held back."""
        drop, repeat, late, nan = self._random.random(4)
        if nan < self._nan:
            cues = cues._replace(force=(math.nan, *cues.force[1:]))
        if drop >= self._drop:
            due = now
            if late < self._late:
                due += self._random.uniform(*_DELAYS)
            copies = 2 if repeat < self._repeat else 1
            for copy in range(copies):
                heapq.heappush(self._held, (due, 2 * cues.sequence + copy, cues))
        while self._held and self._held[0][0] <= now:
            yield heapq.heappop(self._held)[2]
