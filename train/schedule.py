"""How a learning rate goes over a training."""

from __future__ import annotations

import math
from typing import Final

_WARM_UP: Final = 0.1
"""Share of the training in which the learning rate rises."""

_LAST: Final = 0.02
"""Learning rate at the beginning and the end, as a share of the largest."""


def warm_cosine(done: float) -> float:
    """Share of the largest learning rate: a linear rise in the first tenth, then half a cosine.

    Args:
        done: Share of the training.
    """
    done = min(done, 1.0)
    if done < _WARM_UP:
        return max(done / _WARM_UP, _LAST)
    turn = math.pi * (done - _WARM_UP) / (1.0 - _WARM_UP)
    return _LAST + (1.0 - _LAST) * 0.5 * (1.0 + math.cos(turn))
