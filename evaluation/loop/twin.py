"""One batch brought to where another one is, fast: its arrays are copied as bytes."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...envs.task.batch import Batch

Bytes = NDArray[np.uint8]


class Twin:
    """A batch on the CPU that follows another one made alike.

    Batches have snapshots for this; in real time those take too long.

    Args:
        leader: Where it is brought to.
        follower: That is brought there.
    """

    def __init__(self, leader: Batch, follower: Batch) -> None:
        self._leader, self._follower = leader, follower
        arrays = zip(vars(leader.arrays).values(), vars(follower.arrays).values(), strict=True)
        self._arrays = [(_bytes_of(a.view), _bytes_of(b.view)) for a, b in arrays]
        self._states = [_states_of(batch) for batch in (leader, follower)]

    def follow(self) -> None:
        """Bring the follower to where the leader is."""
        for source, target in self._arrays:
            target[...] = source
        leader, follower = self._leader, self._follower
        sources, targets = self._states
        pairs = zip(sources[leader.simulator.current], targets[follower.simulator.current], strict=True)
        for source, target in pairs:
            target[...] = source
        follower.base.restore(leader.base.snapshot())


def _states_of(batch: Batch) -> list[tuple[Bytes, ...]]:
    """Bytes of state and earlier set-points, for both copies that hold in turn."""
    return [tuple(_bytes_of(array.numpy()) for array in pair) for pair in batch.simulator.copies]


def _bytes_of(array: Any) -> Bytes:
    """The memory of an array, flat; no copy."""
    return np.asarray(array).reshape(-1).view(np.uint8)
