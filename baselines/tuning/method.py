"""What a way of searching is: it asks for what to try, and is told what was found."""

from __future__ import annotations

from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from ...envs.settings import NonNegative, configuration
from .objective import Objective
from .space import WashoutSpace

Floats = NDArray[np.float64]


@configuration
class Found:
    """What a step of a search found; a search is repeated from these to the same bits.

    Args:
        hours: Simulated for it, h.
        values: Costs of the sets that were tried, or what else the method needs.
    """

    hours: NonNegative
    values: tuple[float, ...]


class Method(Protocol):
    """A search step by step; everything it draws comes from its seed."""

    @property
    def best(self) -> tuple[float, Floats] | None:
        """Lowest cost on all drives and its place in the unit cube; None before the first."""
        ...

    @property
    def tried(self) -> bool:
        """Whether what was found last has been tried on all drives."""
        ...

    @property
    def converged(self) -> bool:
        """Whether more steps would find nothing."""
        ...

    def measure(self, space: WashoutSpace, objective: Objective) -> Found:
        """Try what is to be tried next."""
        ...

    def tell(self, found: Found) -> None:
        """Take in what was found, now or in an earlier session."""
        ...
