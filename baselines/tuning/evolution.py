"""CMA-ES: whole generations of parameter sets, each through all drives in one launch.

Hansen and Ostermeier, "Completely Derandomized Self-Adaptation in Evolution Strategies", in the
implementation of the package ``cma``.
"""

from __future__ import annotations

from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from .method import Found, Method
from .objective import Objective
from .space import WashoutSpace

Floats = NDArray[np.float64]

STEP: Final = 0.12
"""Standard deviation of the first generation, of the unit cube."""
DRIVES: Final = 24
"""Drives of a generation, drawn anew for each, the same for all its sets."""
GUARDS: Final = 24
"""Most drives that are added because limits were met in them: those with most time at a limit so far."""
_MARGIN: Final = 0.02
"""The start's least distance from the faces of the cube, so that the first spread is not cut there."""


class Evolution(Method):
    """CMA-ES in the unit cube.

    Now and then the middle of the distribution and the best of the last generation are tried on all drives.
    Only these can be the result; and drives in which they meet a limit guard all later generations.

    Args:
        start: (dimension,) where to begin; the first to be tried.
        seed: Of all that is drawn.
    """

    def __init__(self, start: Floats, seed: int) -> None:
        # Not with the module: the package is loaded only by who tunes.
        import cma

        super().__init__()
        random = np.random.default_rng(seed)
        options: dict[str, Any] = {
            "bounds": [0.0, 1.0],
            "randn": lambda *shape: random.standard_normal(shape),
            "seed": np.nan,  # leave NumPy's global generator alone
            "verbose": -9,
        }
        self._strategy = cma.CMAEvolutionStrategy(np.clip(start, _MARGIN, 1.0 - _MARGIN), STEP, options)
        self._seed, self._version = seed, str(cma.__version__)
        self._limited = np.zeros(0)
        self._tried = [np.array(start)]
        self._asked = self._ask()

    @property
    def converged(self) -> bool:
        """Whether one of the strategy's own criteria says so."""
        return bool(self._strategy.stop())

    @property
    def settings(self) -> dict[str, object]:
        """The first spread, drives and guards of a generation, and the version of the package cma."""
        own = {"step": [STEP, _MARGIN], "drives": DRIVES, "guards": GUARDS, "cma": self._version}
        return super().settings | own

    @property
    def _guards(self) -> list[int]:
        worst = np.argsort(-self._limited, kind="stable")[:GUARDS]
        return [int(i) for i in worst if self._limited[i] > 0.0]

    def _trial(self, space: WashoutSpace, objective: Objective) -> Found:
        """Costs and violations of what is tried; behind the costs the time at a limit in each drive."""
        whole = objective.judge([space.decode(place) for place in self._tried])
        limited = whole.limited.sum(axis=0)
        return Found(
            objective.hours() * len(self._tried),
            (*whole.cost.tolist(), *limited.tolist()),
            tuple(whole.violation.tolist()),
        )

    def _compare(self, found: Found) -> None:
        split = len(self._tried)
        for cost, violation, place in zip(found.values[:split], found.violations, self._tried, strict=True):
            self._improves(violation, cost, place)
        limited = np.array(found.values[split:])
        self._limited = limited + (self._limited if len(self._limited) else 0.0)

    def _step(self, space: WashoutSpace, objective: Objective) -> Found:
        """Costs of a generation."""
        drawn = objective.draw(DRIVES, (self._seed, self._count))
        guards = [i for i in self._guards if i not in drawn]
        cost = objective.judge([space.decode(place) for place in self._asked], drawn, guards).cost
        return Found(objective.hours([*drawn, *guards]) * len(self._asked), tuple(cost.tolist()))

    def _move(self, values: tuple[float, ...]) -> None:
        """Select, adapt, and draw the next generation."""
        self._strategy.tell(self._asked, list(values))
        fittest = self._asked[int(np.argmin(values))]
        self._tried = [np.asarray(self._strategy.result.xfavorite), fittest]
        self._asked = self._ask()

    def _ask(self) -> list[Floats]:
        return [np.asarray(place) for place in self._strategy.ask()]
