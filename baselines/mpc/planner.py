"""Plans: linearise, solve, and again where a controller has the time."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np

from ...envs.platform import Platform
from .grid import make_grid
from .linearisation import Floats, Linearisation, Linearised
from .parameters import MpcParameters
from .perceived import Perception
from .problem import Plan, Problem
from .solver import Rows, Solution, solve


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
        relaxed: Largest violation of a linearised limit in the last one, in shares of half its range.
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
        iterations: Most programs a plan; 1 linearises once.
        tolerance: A step that changes no acceleration by more ends the search, m/s^2 and rad/s^2.
    """

    def __init__(
        self, platform: Platform, parameters: MpcParameters, iterations: int = 1, tolerance: float = 0.0
    ) -> None:
        self.grid = make_grid(parameters.nodes)
        self.perception = Perception(self.grid, parameters)
        self._linearised = Linearised(platform, len(self.grid.times), parameters.margins, parameters.compile)
        self._problem = Problem(platform, parameters, self.grid, self.perception.response)
        self._iterations, self._tolerance, self._rounds = iterations, tolerance, parameters.rounds

    def __call__(
        self,
        position: Floats,
        rate: Floats,
        wanted: Floats,
        guess: Floats,
        active: Rows,
        sensed: Floats | None = None,
    ) -> Planned:
        """The plan from a state.

        Args:
            position: (9,) now.
            rate: (9,) now.
            wanted: (n, 6) the car's cues at the nodes, SI.
            guess: (n, 9) accelerations to linearise about.
            active: Limits that may hold.
            sensed: (n, 6) what the sensors remember, see :meth:`.perceived.Perception.memory`.
        """
        search = _Search(self._problem, self._linearised, wanted, sensed)
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
        self, problem: Problem, linearised: Linearised, wanted: Floats, sensed: Floats | None
    ) -> None:
        self._problem, self._linearised, self._wanted, self._sensed = problem, linearised, wanted, sensed
        self._bounds = problem.bounds(linearised.lower, linearised.upper, wanted)

    def program(self, plan: Plan, active: Rows, rounds: int) -> Solution:
        """Solve the program about a plan."""
        about = self._about(plan)
        cost = self._problem.cost(plan, about, self._wanted, self._sensed)
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
        return self._problem.merit(plan, self._about(plan), self._wanted, self._sensed, self._bounds)

    def _about(self, plan: Plan) -> Linearisation:
        return self._linearised(plan.position, plan.rate, plan.acceleration)


_LEAST_SHARE: Final = 1.0 / 16.0
"""Of a change that is tried."""


def after(plan: Plan, change: Plan, share: float = 1.0) -> Plan:
    """A plan with a share of a change."""
    return Plan(
        plan.position + share * change.position,
        plan.rate + share * change.rate,
        plan.acceleration + share * change.acceleration,
    )
