"""The solver: limits enter a program only where they matter.

Without limits the minimum is a Cholesky factorisation away. Limits that it violates, and those that held
last time, then get multipliers; with H = L L' and M = L^-1 A' of their rows A, the dual program

    min 1/2 lambda' (M'M + softness) lambda + slack' lambda,    0 <= lambda <= price

is small, always has a solution, and bounds each multiplier by the price of its limit, which is what an
exact penalty does. Rows that its solution violates join, until none does. That the rows left out hold
makes the solution that of the whole program.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import lapack

from ...envs.errors import ConfigurationError
from .linearisation import Floats, Linearisation
from .problem import Bounds, Plan, Problem, Quadratic

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

_OPTIMAL: Final = 1


@dataclass(frozen=True)
class Solution:
    """What came out of a program.

    Args:
        change: What it adds to the plan.
        active: Rows with a multiplier: flat by node, those of lower bounds behind all of the upper ones.
        rounds: Duals that were given to the solver.
        relaxed: Largest violation of a limit, in shares of half its range.
        solved: Whether it is the minimum.
    """

    change: Plan
    active: Rows
    rounds: int
    relaxed: float
    solved: bool


def solve(
    problem: Problem, cost: Quadratic, about: Linearisation, bounds: Bounds, guess: Rows, rounds: int
) -> Solution:
    """Minimise a cost under the bounds.

    Args:
        problem: Knows what the unknowns do to the rows.
        cost: To be minimised.
        about: The rows, linearised.
        bounds: Of the rows.
        guess: Rows that may hold, as ``Solution.active``.
        rounds: Most duals.
    """
    factor, failed = lapack.dpotrf(cost.hessian, lower=1)
    if failed:
        return _unsolved(problem, guess)
    free = -lapack.dpotrs(factor, cost.gradient, lower=1)[0]
    unknowns, working = free, guess
    multipliers, hard = np.zeros(0), _hard(bounds)
    for count in range(rounds + 1):
        change = problem.change(unknowns)
        excess = _excess(about.ahead(np.hstack([change.position, change.rate, change.acceleration])), bounds)
        relaxed = float(max(np.max(excess[hard]), 0.0))
        excess[working] = 0.0
        violated = np.flatnonzero(excess > TOLERANCE)
        if count and not len(violated):
            return Solution(change, working[multipliers > 0.0], count, relaxed, True)
        working = np.concatenate([working, violated])
        if not len(working):
            return Solution(change, working, 0, 0.0, True)
        if count == rounds:
            break
        solved = _with_rows(problem, about, bounds, factor, free, working)
        if solved is None:
            return _unsolved(problem, guess, count + 1)
        unknowns, multipliers = solved
    return _unsolved(problem, guess, rounds)


def _excess(values: Floats, bounds: Bounds) -> Floats:
    """(2 n k,) how far each row is above its upper bound, then below its lower one."""
    return np.concatenate([(values - bounds.upper).ravel(), (bounds.lower - values).ravel()])


def _hard(bounds: Bounds) -> NDArray[np.bool_]:
    """(2 n k,) rows of the machine's limits."""
    return np.tile(np.isfinite(bounds.price).ravel(), 2)


def _with_rows(
    problem: Problem, about: Linearisation, bounds: Bounds, factor: Floats, free: Floats, working: Rows
) -> tuple[Floats, Floats] | None:
    """Unknowns and multipliers under some of the rows; None where the solver gives up."""
    side, row = np.divmod(working, about.values.size)
    sign = 1.0 - 2.0 * side
    matrix = sign[:, None] * problem.rows(about.slopes, row)
    bound = np.where(side == 0, bounds.upper.ravel()[row], bounds.lower.ravel()[row])
    slack = sign * (bound - about.values.ravel()[row]) - matrix @ free
    m = lapack.dtrtrs(factor, matrix.T, lower=1)[0]
    dual = m.T @ m + np.diag(bounds.softness.ravel()[row])
    dual[np.diag_indices_from(dual)] += _REGULAR * max(float(np.trace(dual)) / len(dual), 1.0)
    price = np.minimum(bounds.price.ravel()[row], _MOST)
    multipliers, _, flag, _ = daqp.solve(dual, slack, np.zeros((0, len(dual))), price, np.zeros(len(dual)))
    if flag != _OPTIMAL:
        return None
    step = lapack.dtrtrs(factor, m @ multipliers, lower=1, trans=1)[0]
    return free - step, np.asarray(multipliers)


_MOST: Final = 1e9
"""Bound of a multiplier that has none."""


def _unsolved(problem: Problem, guess: Rows, rounds: int = 0) -> Solution:
    return Solution(problem.change(np.zeros(problem.size)), guess, rounds, 0.0, False)
