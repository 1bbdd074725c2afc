"""Methods of a search: CMA-ES, and Adam along the gradient of J through washout and machine.

Both work in the unit cube of a :class:`~.objective.WashoutSpace`, on a few drives at a time. Every
:data:`TRY_EVERY` steps they evaluate their best on all drives (a trial); only trials can be the result.

**CMA-ES** (Hansen and Ostermeier 2001, by the package ``cma``): a generation of sets, each through all drives
of the step in one launch.

**Adam** (Kingma and Ba 2015) with the gradient from Warp's tape. J does not show a limit before it is met. So
a set that is no better in a trial than the best goes back there, with half the step.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import Any, ClassVar, Final

import numpy as np
import warp as wp
from numpy.lib.recfunctions import structured_to_unstructured
from numpy.typing import NDArray

from ...envs.settings import NonNegative, configuration
from ..washout.batch import WashoutBatch
from ..washout.families import family_of
from .objective import Objective, WashoutSpace

Floats = NDArray[np.float64]

TRY_EVERY: Final = 5
"""Steps from one trial to the next."""


@configuration
class StepResult:
    """Result of a step or a trial; a search is repeated from these to the same bits.

    Args:
        hours: Time simulated for it, h.
        values: Costs of the evaluated sets; for a gradient J and its derivatives.
        violations: Of a trial: share of time of each set at a limit where none may be met.
    """

    hours: NonNegative
    values: tuple[float, ...]
    violations: tuple[NonNegative, ...] = ()


class Method(ABC):
    """A search step by step, the first of which is a trial; every draw follows from its seed.

    Attributes:
        label: Name in the checksum of a search, which must not change.
    """

    label: ClassVar[str]

    def __init__(self) -> None:
        self._count = 0
        self._best: tuple[bool, float, Floats] | None = None

    @property
    def best(self) -> tuple[float, Floats] | None:
        """Cost of the best set on all drives and its place in the unit cube; None before the first trial.

        A set that meets a limit where none may be met is never better than one that does not, whatever they
        cost.
        """
        return None if self._best is None else self._best[1:]

    @property
    def tried(self) -> bool:
        """Whether the last steps have been followed by a trial."""
        return self._count % (TRY_EVERY + 1) == 1

    @property
    @abstractmethod
    def converged(self) -> bool:
        """Whether further steps would gain nothing."""

    @property
    def settings(self) -> dict[str, object]:
        """Constants that its results depend on, versions of libraries included."""
        return {"method": self.label, "try_every": TRY_EVERY}

    def evaluate(self, space: WashoutSpace, objective: Objective) -> StepResult:
        """Simulate the next step or trial."""
        return self._trial(space, objective) if self._tries else self._step(space, objective)

    def update(self, result: StepResult) -> None:
        """Take in a result, of now or of an earlier session.

        Raises:
            ValueError: it is not a result of :meth:`evaluate` at this point.
        """
        if self._tries:
            self._compare(result)
        else:
            self._move(result.values)
        self._count += 1

    @property
    def _tries(self) -> bool:
        return self._count % (TRY_EVERY + 1) == 0

    def _improves(self, violation: float, cost: float, place: Floats) -> bool:
        """Whether a set is better than all before; if so, it becomes the best."""
        rank = (violation > 0.0, cost)
        if self._best is not None and rank >= self._best[:2]:
            return False
        self._best = (*rank, place.copy())
        return True

    @abstractmethod
    def _trial(self, space: WashoutSpace, objective: Objective) -> StepResult:
        """Costs and violations on all drives."""

    @abstractmethod
    def _compare(self, result: StepResult) -> None:
        """Update with a trial."""

    @abstractmethod
    def _step(self, space: WashoutSpace, objective: Objective) -> StepResult:
        """Values for the next move."""

    @abstractmethod
    def _move(self, values: tuple[float, ...]) -> None:
        """Update with the values of a step."""


STEP: Final = 0.12
"""Standard deviation of the first generation, in the unit cube."""
DRIVES: Final = 24
"""Drives of a generation, drawn anew for each, the same for all its sets."""
GUARDS: Final = 24
"""Most drives that are added because limits were met in them: those with most time at a limit so far."""
_MARGIN: Final = 0.02
"""The start's least distance from the faces of the cube, so that the first spread is not cut there."""


class CmaEs(Method):
    """CMA-ES in the unit cube.

    A trial has the mean of the distribution and the best of the last generation. Drives in which they meet a
    limit guard all later generations.

    Args:
        start: (dimension,) where to begin; the first to be tried.
        seed: Of all that is drawn.
    """

    label = "Evolution"

    def __init__(self, start: Floats, seed: int) -> None:
        # Imported here, so that only a search loads the package.
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
        self._candidates = [np.array(start)]
        self._generation = self._draw()

    @property
    def converged(self) -> bool:
        """Whether a criterion of the strategy is met."""
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

    def _trial(self, space: WashoutSpace, objective: Objective) -> StepResult:
        """Costs and violations of the candidates; behind the costs the time at a limit in each drive."""
        whole = objective.evaluate([space.decode(place) for place in self._candidates])
        limited = whole.limited.sum(axis=0)
        return StepResult(
            objective.hours() * len(self._candidates),
            (*whole.cost.tolist(), *limited.tolist()),
            tuple(whole.violation.tolist()),
        )

    def _compare(self, result: StepResult) -> None:
        split = len(self._candidates)
        for cost, violation, place in zip(
            result.values[:split], result.violations, self._candidates, strict=True
        ):
            self._improves(violation, cost, place)
        limited = np.array(result.values[split:])
        self._limited = limited + (self._limited if len(self._limited) else 0.0)

    def _step(self, space: WashoutSpace, objective: Objective) -> StepResult:
        """Costs of a generation."""
        drawn = objective.draw(DRIVES, (self._seed, self._count))
        guards = [i for i in self._guards if i not in drawn]
        cost = objective.evaluate([space.decode(place) for place in self._generation], drawn, guards).cost
        return StepResult(objective.hours([*drawn, *guards]) * len(self._generation), tuple(cost.tolist()))

    def _move(self, values: tuple[float, ...]) -> None:
        """Select, adapt, and draw the next generation."""
        self._strategy.tell(self._generation, list(values))
        fittest = self._generation[int(np.argmin(values))]
        self._candidates = [np.asarray(self._strategy.result.xfavorite), fittest]
        self._generation = self._draw()

    def _draw(self) -> list[Floats]:
        return [np.asarray(place) for place in self._strategy.ask()]


DESCENT_STEP: Final = 0.02
"""First step of Adam, of the unit cube."""
SMALLEST_DESCENT_STEP: Final = 1e-4
"""A step that is halved below this has converged."""
DESCENT_DRIVES: Final = 32
"""Drives of one gradient, drawn anew each time."""
_DECAY: Final = (0.8, 0.95)
"""Decay of Adam's two moments: a search has some hundred steps, not a million."""
_TINY: Final = 1e-8
_DIFFERENCE: Final = 1e-5
"""Half the difference from which the derivative of the kernel's parameters by place is taken."""


class GradientDescent(Method):
    """Adam in the unit cube; a trial that is no better than the best goes back there.

    Args:
        start: (dimension,) where to begin.
        seed: Of the drives that are drawn.
    """

    label = "Descent"

    def __init__(self, start: Floats, seed: int) -> None:
        super().__init__()
        self._seed = seed
        self._place = np.array(start)
        self._length = DESCENT_STEP
        self._reset_moments()

    def _reset_moments(self) -> None:
        self._mean, self._square, self._since = np.zeros_like(self._place), np.zeros_like(self._place), 0

    @property
    def converged(self) -> bool:
        """Whether the step is below its least size."""
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

    def _trial(self, space: WashoutSpace, objective: Objective) -> StepResult:
        whole = objective.evaluate([space.decode(self._place)])
        return StepResult(objective.hours(), tuple(whole.cost.tolist()), tuple(whole.violation.tolist()))

    def _compare(self, result: StepResult) -> None:
        """Go back to the best, with half the step, from a set that is no better."""
        (cost,), (violation,) = result.values, result.violations
        if not self._improves(violation, cost, self._place) and self.best is not None:
            self._place = self.best[1].copy()
            self._length *= 0.5
            self._reset_moments()

    def _step(self, space: WashoutSpace, objective: Objective) -> StepResult:
        """J and its gradient on a few of the drives."""
        drawn = objective.draw(DESCENT_DRIVES, (self._seed, self._count))
        cost, gradient = place_gradient(space, self._place, objective, drawn)
        return StepResult(objective.hours(drawn), (cost, *gradient.tolist()))

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
        drawn: Indices of the drives; all are cut to the length of the shortest.
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
