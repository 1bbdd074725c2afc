"""What a way of searching is: steps, and now and then a trial on all drives, where results come from."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import Any, Final

import numpy as np
import warp as wp
from numpy.lib.recfunctions import structured_to_unstructured
from numpy.typing import NDArray

from ...envs.settings import NonNegative, configuration
from ..washout.batch import WashoutBatch
from ..washout.families import family_of
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


# CMA-ES: whole generations of parameter sets, each through all drives in one launch.
#
# Hansen and Ostermeier, "Completely Derandomized Self-Adaptation in Evolution Strategies", in the
# implementation of the package ``cma``.


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


# Descent along the gradient of J through washout and machine, by Warp's tape.
#
# Adam (Kingma and Ba, "Adam: A Method for Stochastic Optimization") on a few drives at a time. J says
# nothing of a limit before it is met: now and then the set is tried on all drives, and one that is no better
# than the best goes back there with half the step.


DESCENT_STEP: Final = 0.02
"""First step of Adam, of the unit cube."""
SMALLEST_DESCENT_STEP: Final = 1e-4
"""A step that is halved below this has converged."""
DESCENT_DRIVES: Final = 32
"""Drives of one gradient, drawn anew each time."""
_DECAY: Final = (0.8, 0.95)
"""Of Adam's two moments: a search has some hundred steps, not a million."""
_TINY: Final = 1e-8
_DIFFERENCE: Final = 1e-5
"""Half the difference from which the derivative of the kernel's parameters by place is taken."""


class Descent(Method):
    """Adam in the unit cube, held to what is no worse on all drives.

    Args:
        start: (dimension,) where to begin.
        seed: Of the drives that are drawn.
    """

    def __init__(self, start: Floats, seed: int) -> None:
        super().__init__()
        self._seed = seed
        self._place = np.array(start)
        self._length = DESCENT_STEP
        self._forget()

    def _forget(self) -> None:
        self._mean, self._square, self._since = np.zeros_like(self._place), np.zeros_like(self._place), 0

    @property
    def converged(self) -> bool:
        """Whether the steps have become too small to matter."""
        return self._length < SMALLEST_DESCENT_STEP

    @property
    def settings(self) -> dict[str, object]:
        """Lengths of steps, drives of one, and Adam's constants."""
        return super().settings | {
            "step": [DESCENT_STEP, SMALLEST_DESCENT_STEP],
            "drives": DESCENT_DRIVES,
            "decay": [*_DECAY, _TINY],
            "difference": _DIFFERENCE,
        }

    def _trial(self, space: WashoutSpace, objective: Objective) -> Found:
        whole = objective.judge([space.decode(self._place)])
        return Found(objective.hours(), tuple(whole.cost.tolist()), tuple(whole.violation.tolist()))

    def _compare(self, found: Found) -> None:
        """Go back to the best, with half the step, from what is no better."""
        (cost,), (violation,) = found.values, found.violations
        if not self._improves(violation, cost, self._place) and self.best is not None:
            self._place = self.best[1].copy()
            self._length *= 0.5
            self._forget()

    def _step(self, space: WashoutSpace, objective: Objective) -> Found:
        """J and its gradient on a few of the drives."""
        drawn = objective.draw(DESCENT_DRIVES, (self._seed, self._count))
        cost, gradient = place_gradient(space, self._place, objective, drawn)
        return Found(objective.hours(drawn), (cost, *gradient.tolist()))

    def _move(self, values: tuple[float, ...]) -> None:
        """One step of Adam."""
        gradient = np.array(values[1:])
        self._since += 1
        self._mean += (1.0 - _DECAY[0]) * (gradient - self._mean)
        self._square += (1.0 - _DECAY[1]) * (gradient**2 - self._square)
        mean = self._mean / (1.0 - _DECAY[0] ** self._since)
        square = self._square / (1.0 - _DECAY[1] ** self._since)
        self._place = np.clip(self._place - self._length * mean / (np.sqrt(square) + _TINY), 0.0, 1.0)


def place_gradient(
    space: WashoutSpace, place: Floats, objective: Objective, drawn: list[int]
) -> tuple[float, Floats]:
    """Mean J over whole drives, and its gradient (dimension,) in the place.

    Args:
        space: The unit cube.
        place: (dimension,) in it.
        objective: Has machine and drives.
        drawn: Which drives; of those of different length as much as the shortest has.
    """
    drives = [objective.drives[i] for i in drawn]
    batch = WashoutBatch([space.decode(place)], drives, objective.platform)
    steps = min(len(drive) for drive in drives) - 1
    cost, gradient = batch.gradient(steps)
    inner = _flat(gradient)[0]
    slopes = _kernel_slopes(space, place, objective)
    used = slopes != 0.0
    return float(cost[0]), np.array([row[on] @ inner[on] for row, on in zip(slopes, used, strict=True)])


def _kernel_slopes(space: WashoutSpace, place: Floats, objective: Objective) -> Floats:
    """(dimension, parameters of the kernel) derivatives of the latter by the places, one-sided at a face."""
    rows = []
    for axis in range(len(space)):
        ends = np.clip(place[axis] + np.array([-_DIFFERENCE, _DIFFERENCE]), 0.0, 1.0)
        moved = [np.where(np.arange(len(space)) == axis, end, place) for end in ends]
        sides = [_kernel_values(space, one, objective) for one in moved]
        rows.append((sides[1] - sides[0]) / (ends[1] - ends[0]))
    return np.array(rows)


def _kernel_values(space: WashoutSpace, place: Floats, objective: Objective) -> Floats:
    kernels = family_of(space.start).kernels
    parameters = kernels.values(space.decode(place), objective.platform.cab, objective.drives[0].dt)
    values: Floats = _flat(wp.array([parameters], dtype=kernels.parameters, device="cpu").numpy())[0]
    return values


def _flat(values: NDArray[Any]) -> Floats:
    return np.asarray(structured_to_unstructured(values, dtype=np.float64))
