"""One thread for small matrices.

BLAS shares a product among all cores. For matrices of this size that gains nothing on an idle machine, and on
a busy one the threads wait for each other: 130 ms instead of 1 ms was measured.
"""

from __future__ import annotations

from contextlib import AbstractContextManager
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import lapack

from ...envs.errors import ConfigurationError
from ...envs.platform import Platform
from .parameters import MpcParameters
from .prediction import Floats, Linearization, Linearized, Perception, make_grid
from .problem import Bounds, Plan, Problem, Quadratic

try:
    from threadpoolctl import ThreadpoolController
except ImportError:
    raise ConfigurationError(
        "this controller needs threadpoolctl, which is not installed: "
        "pip install 'motion-cueing-gym[optimal]'"
    ) from None


class OneThread:
    """Holds the libraries that are loaded when it is made to one thread: ``with one_thread(): ...``."""

    def __init__(self) -> None:
        self._libraries: Any = ThreadpoolController()

    def __call__(self) -> AbstractContextManager[Any]:
        """For the length of a block."""
        return self._libraries.limit(limits=1, user_api="blas")  # type: ignore[no-any-return]


# The solver: limits enter a program only where they matter.
#
# Without limits the minimum is a Cholesky factorization away. Limits that it violates, and those that held
# last time, then get multipliers; with H = L L' and M = L^-1 A' of their rows A, the dual program
#
#     min 1/2 lambda' (M'M + softness) lambda + slack' lambda,    0 <= lambda <= price
#
# is small, always has a solution, and bounds each multiplier by the price of its limit, which is what an
# exact penalty does. Rows that its solution violates join, until none does. That the rows left out hold
# makes the solution that of the whole program.


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
    problem: Problem, cost: Quadratic, about: Linearization, bounds: Bounds, guess: Rows, rounds: int
) -> Solution:
    """Minimize a cost under the bounds.

    Args:
        problem: Knows what the unknowns do to the rows.
        cost: To be minimized.
        about: The rows, linearized.
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
    problem: Problem, about: Linearization, bounds: Bounds, factor: Floats, free: Floats, working: Rows
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


# Plans: linearize, solve, and again where a controller has the time.


@dataclass(frozen=True)
class Planned:
    """A plan and how it came about.

    Args:
        plan: At the nodes.
        active: Limits that hold, to begin the next search with.
        solved: Whether every program was solved.
        converged: Whether the last program asked for next to no change, or there was to be but one.
        iterations: Programs solved.
        rounds: Duals solved in all of them.
        relaxed: Largest violation of a linearized limit in the last one, in shares of half its range.
    """

    plan: Plan
    active: Rows
    solved: bool
    converged: bool
    iterations: int
    rounds: int
    relaxed: float


class Planner:
    """Gauss-Newton sequential quadratic programming over the horizon.

    A plan that is made of several programs is searched for along each one's change: half the change is
    tried where the whole one costs more. A plan of one program takes its change as it is.

    Args:
        platform: The machine.
        parameters: Of the controller.
        iterations: Most programs a plan; 1 linearizes once.
        tolerance: A step that changes no acceleration by more ends the search, m/s^2 and rad/s^2.
    """

    def __init__(
        self, platform: Platform, parameters: MpcParameters, iterations: int = 1, tolerance: float = 0.0
    ) -> None:
        self.grid = make_grid(parameters.nodes)
        self.perception = Perception(self.grid, parameters)
        self._linearized = Linearized(platform, len(self.grid.times), parameters.margins, parameters.compile)
        self._problem = Problem(platform, parameters, self.grid, self.perception.response)
        self._iterations, self._tolerance, self._rounds = iterations, tolerance, parameters.rounds

    def __call__(
        self,
        position: Floats,
        rate: Floats,
        reference: Floats,
        guess: Floats,
        active: Rows,
        sensed: Floats | None = None,
    ) -> Planned:
        """The plan from a state.

        Args:
            position: (9,) now.
            rate: (9,) now.
            reference: (n, 6) the car's cues at the nodes, SI.
            guess: (n, 9) accelerations to linearize about.
            active: Limits that may hold.
            sensed: (n, 6) what the sensors remember, see :meth:`.perceived.Perception.memory`.
        """
        search = _Search(self._problem, self._linearized, reference, sensed)
        plan = Plan(*self.grid.motion(position, rate, guess), guess)
        rounds = 0
        for count in range(1, self._iterations + 1):
            solution = search.program(plan, active, self._rounds)
            rounds, active = rounds + solution.rounds, solution.active
            if not solution.solved:
                return Planned(plan, active, False, False, count, rounds, 0.0)
            share = 1.0 if self._iterations == 1 else search.share(plan, solution.change)
            plan = after(plan, solution.change, share)
            largest = float(np.max(np.abs(solution.change.acceleration)))
            if share * largest <= self._tolerance:
                break
        # Of the whole change: a plan from which no share of it is taken is stuck, not at its end.
        converged = self._iterations == 1 or largest <= self._tolerance
        return Planned(plan, active, True, converged, count, rounds, solution.relaxed)


class _Search:
    """The programs of one plan."""

    def __init__(
        self, problem: Problem, linearized: Linearized, reference: Floats, sensed: Floats | None
    ) -> None:
        self._problem, self._linearized, self._reference, self._sensed = (
            problem,
            linearized,
            reference,
            sensed,
        )
        self._bounds = problem.bounds(linearized.lower, linearized.upper, reference)

    def program(self, plan: Plan, active: Rows, rounds: int) -> Solution:
        """Solve the program about a plan."""
        about = self._about(plan)
        cost = self._problem.cost(plan, about, self._reference, self._sensed)
        return solve(self._problem, cost, about, self._bounds, active, rounds)

    def share(self, plan: Plan, change: Plan) -> float:
        """The first of 1, 1/2, 1/4 ... of a change that lowers the cost; 0 if none does."""
        before, share = self._merit(plan), 1.0
        while share >= _LEAST_SHARE:
            if self._merit(after(plan, change, share)) < before:
                return share
            share *= 0.5
        return 0.0

    def _merit(self, plan: Plan) -> float:
        return self._problem.merit(plan, self._about(plan), self._reference, self._sensed, self._bounds)

    def _about(self, plan: Plan) -> Linearization:
        return self._linearized(plan.position, plan.rate, plan.acceleration)


_LEAST_SHARE: Final = 1.0 / 16.0
"""Of a change that is tried."""


def after(plan: Plan, change: Plan, share: float = 1.0) -> Plan:
    """A plan with a share of a change."""
    return Plan(
        plan.position + share * change.position,
        plan.rate + share * change.rate,
        plan.acceleration + share * change.acceleration,
    )
