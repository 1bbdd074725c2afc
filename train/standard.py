"""Observations and actions relative to what they are under a first policy, as a network learns best.

The rows of an observation have the scale of what can happen, and an action of 1 is all the machine can do; a
good policy's errors are a hundredth of the one, and its actions of the other.
"""

from __future__ import annotations

from typing import Final

import numpy as np
import torch
from numpy.typing import NDArray

from ..envs.task.batch import Batch
from ..envs.task.layout import MACHINE, Layout
from .actor import Actor

Floats = NDArray[np.float32]

_LEAST_SEEN: Final = 0.02
"""Smallest deviation of an observation: what hardly moves under the first policy may move later."""

_LEAST_TOLD: Final = 0.3
"""The same of what a machine can do: few are met at first, and others are met later."""

_LEAST_DONE: Final = 0.01
"""Smallest reach of an action."""


def standardise(actor: Actor, batch: Batch, actions: int) -> None:
    """Give an actor the standard of what it sees and does as it is.

    Args:
        actor: The network, without a standard so far.
        batch: Its environments; they begin anew.
        actions: How many are taken in each.
    """
    everywhere = np.ones(batch.n, dtype=bool)
    batch.begin(everywhere)
    batch.observe(everywhere)
    seen, done = [], []
    for _ in range(actions):
        seen.append(batch.arrays.observation.pull().copy())
        with torch.no_grad():
            done.append(actor(torch.from_numpy(seen[-1])).numpy())
        batch.write(done[-1])
        batch.step()
    take_standard(actor, np.concatenate(seen), np.concatenate(done), _least_seen(batch.layout))


def _least_seen(layout: Layout) -> NDArray[np.float64]:
    """(size,) smallest deviation of each entry."""
    told = {row.name for row in MACHINE}
    frame = [_LEAST_TOLD if row.name in told else _LEAST_SEEN for row in layout.rows for _ in range(row.size)]
    return np.tile(frame, layout.stack)


def take_standard(
    actor: Actor, seen: Floats, done: Floats, least: NDArray[np.float64] | float = _LEAST_SEEN
) -> None:
    """Give an actor the standard of what is seen and done in a drive.

    Args:
        actor: The network, without a standard so far.
        seen: (k, size) observations.
        done: (k, action_size) actions.
        least: Smallest deviation of what is seen, (size,) or one for all.
    """
    mean, deviation = seen.mean(axis=0, dtype=np.float64), seen.std(axis=0, dtype=np.float64)
    reach = np.maximum(done.std(axis=0, dtype=np.float64), _LEAST_DONE)
    standard = mean, np.maximum(deviation, least), reach
    actor.standardise(*(torch.from_numpy(x).float() for x in standard))
