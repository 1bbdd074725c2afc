r"""Solution of a plan: an active-set method on the dual of each quadratic program, and their sequence.

**Quadratic program.** Without limits the minimum is a Cholesky factorization away. Rows that it violates, and
rows that held last time, get multipliers. With H = L L' and M = L^-1 A' of their rows A, the dual program

    min_lambda  1/2 lambda' (M'M + softness) lambda + slack' lambda,    0 <= lambda <= price

is small, always has a solution, and bounds each multiplier by the price of its limit (exact penalty). DAQP
solves it. Rows that its solution violates join, until none does. Then it is the solution of the whole
program, as all other rows hold (:func:`solve`).

**Plan.** Linear control linearizes once about the last plan and takes the whole step. Nonlinear control is
sequential quadratic programming: it linearizes about each new plan until the accelerations no longer change.
A backtracking search on the exact cost and the exact limits shortens a step that would raise them
(:class:`Planner`). Shooting from node to node is exact and linear, so the states are eliminated, and only
cues and legs are nonlinear.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import lapack

from ...envs.errors import ConfigurationError
from ...envs.platform import Platform
from .parameters import MpcParameters
from .prediction import Floats, Linearization, MachineModel, PerceivedError, make_grid
from .problem import Bounds, HorizonProgram, Motion, QuadraticCost

try:
    import daqp as _daqp
except ImportError:
    raise ConfigurationError(
        "this controller needs the solver DAQP, which is not installed: "
        "pip install 'motion-cueing-gym[optimal]'"
    ) from None

daqp: Any = _daqp

Rows = NDArray[np.intp]

TOLERANCE: Final = 1e-6
"""Largest violation of a row that counts as none, in shares of half a limit's range."""

_REGULAR: Final = 1e-9
"""Added to the dual's diagonal, relative to its mean: rows may depend on each other."""

_UNBOUNDED: Final = 1e9
"""Bound of a multiplier that has none."""

_OPTIMAL: Final = 1

_LEAST_SHARE: Final = 1.0 / 16.0
"""Smallest share of a step that the backtracking search tries."""


@dataclass(frozen=True)
class QpSolution:
    """Solution of a quadratic program.

    Args:
        change: Step of the motion.
        active: Rows with a multiplier: flat by node, those of lower bounds behind all of the upper ones.
        rounds: Dual programs solved.
        relaxed: Largest violation of a limit, in shares of half its range.
        solved: Whether it is the minimum.
    """

    change: Motion
    active: Rows
    rounds: int
    relaxed: float
    solved: bool


def solve(
    program: HorizonProgram,
    cost: QuadraticCost,
    about: Linearization,
    bounds: Bounds,
    guess: Rows,
    rounds: int,
) -> QpSolution:
    """Minimize a cost under bounds.

    Args:
        program: Maps unknowns to rows.
        cost: Hessian and gradient.
        about: The rows, linearized.
        bounds: Of the rows.
        guess: Rows that may be active, as ``QpSolution.active``.
        rounds: Greatest number of dual programs.
    """
    unsolved = program.change(np.zeros(program.size))
    factor, failed = lapack.dpotrf(cost.hessian, lower=1)
    if failed:
        return QpSolution(unsolved, guess, 0, 0.0, False)
    free = -lapack.dpotrs(factor, cost.gradient, lower=1)[0]
    unknowns, working, multipliers = free, guess, np.zeros(0)
    hard = np.tile(np.isfinite(bounds.price).ravel(), 2)
    for count in range(rounds + 1):
        change = program.change(unknowns)
        values = about.at(np.hstack([change.position, change.rate, change.acceleration]))
        excess = np.concatenate([(values - bounds.upper).ravel(), (bounds.lower - values).ravel()])
        relaxed = float(max(np.max(excess[hard]), 0.0))
        excess[working] = 0.0
        violated = np.flatnonzero(excess > TOLERANCE)
        if count and not len(violated):
            return QpSolution(change, working[multipliers > 0.0], count, relaxed, True)
        working = np.concatenate([working, violated])
        if not len(working):
            return QpSolution(change, working, 0, 0.0, True)
        if count == rounds:
            break
        solution = _solve_dual(program, about, bounds, factor, free, working)
        if solution is None:
            return QpSolution(unsolved, guess, count + 1, 0.0, False)
        unknowns, multipliers = solution
    return QpSolution(unsolved, guess, rounds, 0.0, False)


def _solve_dual(
    program: HorizonProgram,
    about: Linearization,
    bounds: Bounds,
    factor: Floats,
    free: Floats,
    working: Rows,
) -> tuple[Floats, Floats] | None:
    """Unknowns and multipliers under the working rows; None where the solver gives up.

    Args:
        program: Maps unknowns to rows.
        about: The rows, linearized.
        bounds: Of the rows.
        factor: L of the Hessian.
        free: (m,) minimum without rows.
        working: The rows A.
    """
    side, row = np.divmod(working, about.values.size)
    sign = 1.0 - 2.0 * side
    matrix = sign[:, None] * program.rows(about.slopes, row)
    bound = np.where(side == 0, bounds.upper.ravel()[row], bounds.lower.ravel()[row])
    slack = sign * (bound - about.values.ravel()[row]) - matrix @ free
    m = lapack.dtrtrs(factor, matrix.T, lower=1)[0]
    dual = m.T @ m + np.diag(bounds.softness.ravel()[row])
    dual[np.diag_indices_from(dual)] += _REGULAR * max(float(np.trace(dual)) / len(dual), 1.0)
    price = np.minimum(bounds.price.ravel()[row], _UNBOUNDED)
    multipliers, _, flag, _ = daqp.solve(dual, slack, np.zeros((0, len(dual))), price, np.zeros(len(dual)))
    if flag != _OPTIMAL:
        return None
    step = lapack.dtrtrs(factor, m @ multipliers, lower=1, trans=1)[0]
    return free - step, np.asarray(multipliers)


@dataclass(frozen=True)
class Plan:
    """A plan and how it was found.

    Args:
        motion: At the nodes.
        active: Limits that hold, to begin the next search with.
        solved: Whether every program was solved.
        converged: Whether the last step was next to nothing, or linear control took its only one.
        iterations: Quadratic programs solved.
        rounds: Dual programs solved in all of them.
        relaxed: Largest violation of a linearized limit in the last one, in shares of half its range.
    """

    motion: Motion
    active: Rows
    solved: bool
    converged: bool
    iterations: int
    rounds: int
    relaxed: float


class Planner:
    """Gauss-Newton sequential quadratic programming over the horizon.

    Args:
        platform: The machine.
        parameters: Of the controller.
    """

    def __init__(self, platform: Platform, parameters: MpcParameters) -> None:
        self.grid = make_grid(parameters.nodes)
        self.perceived = PerceivedError(self.grid, parameters)
        self._model = MachineModel(platform, len(self.grid.times), parameters.margins, parameters.compile)
        self._program = HorizonProgram(platform, parameters, self.grid, self.perceived.response)
        self._iterations = parameters.iterations if parameters.nonlinear else 1
        self._tolerance, self._rounds = parameters.tolerance, parameters.rounds

    def __call__(
        self,
        position: Floats,
        rate: Floats,
        reference: Floats,
        guess: Floats,
        active: Rows,
        free_response: Floats | None = None,
    ) -> Plan:
        """The plan from a state.

        Args:
            position: (9,) now.
            rate: (9,) now.
            reference: (n, 6) reference cue at the nodes, SI.
            guess: (n, 9) accelerations to linearize about.
            active: Limits that may hold.
            free_response: (n, 6) perceived error that past errors leave, in zones.
        """
        bounds = self._program.bounds(self._model.lower, self._model.upper, reference)

        def merit(motion: Motion) -> float:
            about = self._linearized(motion)
            return self._program.merit(motion, about, reference, free_response, bounds)

        motion = Motion(*self.grid.motion(position, rate, guess), guess)
        rounds = 0
        for count in range(1, self._iterations + 1):
            about = self._linearized(motion)
            cost = self._program.cost(motion, about, reference, free_response)
            solution = solve(self._program, cost, about, bounds, active, self._rounds)
            rounds, active = rounds + solution.rounds, solution.active
            if not solution.solved:
                return Plan(motion, active, False, False, count, rounds, 0.0)
            share = 1.0 if self._iterations == 1 else _backtrack(merit, motion, solution.change)
            motion = stepped(motion, solution.change, share)
            largest = float(np.max(np.abs(solution.change.acceleration)))
            if share * largest <= self._tolerance:
                break
        # Of the whole step: a plan from which no share of it is taken is stuck, not at a minimum.
        converged = self._iterations == 1 or largest <= self._tolerance
        return Plan(motion, active, True, converged, count, rounds, solution.relaxed)

    def _linearized(self, motion: Motion) -> Linearization:
        return self._model(motion.position, motion.rate, motion.acceleration)


def _backtrack(merit: Callable[[Motion], float], motion: Motion, change: Motion) -> float:
    """The first of 1, 1/2, 1/4 ... of a change that lowers the merit function; 0 if none does."""
    before, share = merit(motion), 1.0
    while share >= _LEAST_SHARE:
        if merit(stepped(motion, change, share)) < before:
            return share
        share *= 0.5
    return 0.0


def stepped(motion: Motion, change: Motion, share: float = 1.0) -> Motion:
    """A motion after a share of a change."""
    return Motion(
        motion.position + share * change.position,
        motion.rate + share * change.rate,
        motion.acceleration + share * change.acceleration,
    )
