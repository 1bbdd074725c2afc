"""Random numbers that depend only on an environment's seed and its episode: the same alone or in a batch.

A counter goes through the finalizer of SplitMix64 (Steele, Lea and Flood 2014), so a whole batch is
drawn at once, and an environment's numbers do not depend on its neighbors.
"""

from __future__ import annotations

from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

Words = NDArray[np.uint64]

_GOLDEN: Final = np.uint64(0x9E3779B97F4A7C15)
_MIX: Final = (np.uint64(0xBF58476D1CE4E5B9), np.uint64(0x94D049BB133111EB))
_SHIFTS: Final = (np.uint64(30), np.uint64(27), np.uint64(31))


def key_of(seed: int) -> int:
    """The 64-bit key of a seed: neighboring seeds have unlike keys."""
    return int(np.random.SeedSequence(seed).generate_state(1, np.uint64)[0])


def mixed(words: Words) -> Words:
    """SplitMix64's finalizer: every bit of a word changes half the bits of the result."""
    words = (words ^ (words >> _SHIFTS[0])) * _MIX[0]
    words = (words ^ (words >> _SHIFTS[1])) * _MIX[1]
    return words ^ (words >> _SHIFTS[2])


def words(keys: Words, episodes: NDArray[np.integer[Any]], count: int) -> Words:
    """(n, count) random words for the episodes (n,) of environments with keys (n,)."""
    streams = mixed(keys + _GOLDEN * (episodes.astype(np.uint64) + np.uint64(1)))
    counters = np.arange(1, count + 1, dtype=np.uint64) * _GOLDEN
    return mixed(streams[:, None] + counters)


def uniform(words: Words) -> NDArray[np.float64]:
    """Numbers in [0, 1) from the upper 53 bits of words."""
    return np.asarray((words >> np.uint64(11)) * 2.0**-53, dtype=np.float64)
