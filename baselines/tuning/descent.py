"""Descent along the gradient of J through washout and machine, by Warp's tape.

Adam (Kingma and Ba, "Adam: A Method for Stochastic Optimization") on a few drives at a time. J says
nothing of a limit before it is met: now and then the set is tried on all drives, and one that is no better
than the best goes back there with half the step.
"""

from __future__ import annotations

from typing import Any, Final

import numpy as np
import warp as wp
from numpy.lib.recfunctions import structured_to_unstructured
from numpy.typing import NDArray

from ..washout import WashoutParameters
from ..washout.batch import WashoutBatch
from ..washout.classical import kernel_parameters
from ..washout.structs import Parameters
from .method import Found, Method
from .objective import Objective
from .space import WashoutSpace

Floats = NDArray[np.float64]

STEP: Final = 0.02
"""First step of Adam, of the unit cube."""
SMALLEST_STEP: Final = 1e-4
"""A step that is halved below this has converged."""
DRIVES: Final = 32
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
        self._length = STEP
        self._forget()

    def _forget(self) -> None:
        self._mean, self._square, self._since = np.zeros_like(self._place), np.zeros_like(self._place), 0

    @property
    def converged(self) -> bool:
        """Whether the steps have become too small to matter."""
        return self._length < SMALLEST_STEP

    @property
    def settings(self) -> dict[str, object]:
        """Lengths of steps, drives of one, and Adam's constants."""
        return super().settings | {
            "step": [STEP, SMALLEST_STEP],
            "drives": DRIVES,
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
        drawn = objective.draw(DRIVES, (self._seed, self._count))
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
    decoded = space.decode(place)
    assert isinstance(decoded, WashoutParameters), "the options of a search refuse other families"
    parameters = kernel_parameters(decoded, objective.platform.cab)
    values: Floats = _flat(wp.array([parameters], dtype=Parameters, device="cpu").numpy())[0]
    return values


def _flat(values: NDArray[Any]) -> Floats:
    return np.asarray(structured_to_unstructured(values, dtype=np.float64))
