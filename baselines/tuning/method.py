"""What a way of searching is: steps, and now and then a trial on all drives, where results come from."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import Final

import numpy as np
from numpy.typing import NDArray

from ...envs.settings import NonNegative, configuration
from .objective import Objective
from .space import WashoutSpace

Floats = NDArray[np.float64]

TRY_EVERY: Final = 5
"""Steps from one trial to the next."""


@configuration
class Found:
    """What a step or a trial found; a search is repeated from these to the same bits.

    Args:
        hours: Simulated for it, h.
        values: Costs of the sets that were tried, or what else the method needs.
        violations: Of a trial: the share of time each set is at a limit where none may be met.
    """

    hours: NonNegative
    values: tuple[float, ...]
    violations: tuple[NonNegative, ...] = ()


class Method(ABC):
    """A search step by step, the first of which is a trial; everything it draws comes from its seed."""

    def __init__(self) -> None:
        self._count = 0
        self._best: tuple[bool, float, Floats] | None = None

    @property
    def best(self) -> tuple[float, Floats] | None:
        """Cost of the best set on all drives and its place in the unit cube; None before the first.

        A set that meets a limit where none may be met is never better than one that does not, whatever they
        cost.
        """
        return None if self._best is None else self._best[1:]

    @property
    def tried(self) -> bool:
        """Whether what was found last has been tried on all drives."""
        return self._count % (TRY_EVERY + 1) == 1

    @property
    @abstractmethod
    def converged(self) -> bool:
        """Whether more steps would find nothing."""

    @property
    def settings(self) -> dict[str, object]:
        """What is fixed about it and decides what it finds, versions of libraries included."""
        return {"method": type(self).__name__, "try_every": TRY_EVERY}

    def measure(self, space: WashoutSpace, objective: Objective) -> Found:
        """Try what is to be tried next, on all drives if it is its turn."""
        return self._trial(space, objective) if self._tries else self._step(space, objective)

    def tell(self, found: Found) -> None:
        """Take in what was found, now or in an earlier session.

        Raises:
            ValueError: it is not what :meth:`measure` gives here.
        """
        if self._tries:
            self._compare(found)
        else:
            self._move(found.values)
        self._count += 1

    @property
    def _tries(self) -> bool:
        return self._count % (TRY_EVERY + 1) == 0

    def _improves(self, violation: float, cost: float, place: Floats) -> bool:
        """Whether a set is better than all before; if so, it is kept."""
        rank = (violation > 0.0, cost)
        if self._best is not None and rank >= self._best[:2]:
            return False
        self._best = (*rank, place.copy())
        return True

    @abstractmethod
    def _trial(self, space: WashoutSpace, objective: Objective) -> Found:
        """Costs and violations on all drives."""

    @abstractmethod
    def _compare(self, found: Found) -> None:
        """Take in a trial."""

    @abstractmethod
    def _step(self, space: WashoutSpace, objective: Objective) -> Found:
        """What the next move needs to know."""

    @abstractmethod
    def _move(self, values: tuple[float, ...]) -> None:
        """Take in a step."""
