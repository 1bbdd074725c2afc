"""Plans: linearise, solve, and again where a controller has the time."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from ...envs.platform import Platform
from .grid import make_grid
from .linearisation import Floats, Linearised
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
        iterations: Programs solved.
        rounds: Duals solved in all of them.
        relaxed: Largest violation of a linearised limit in the last one, in shares of its range.
    """

    plan: Plan
    active: Rows
    solved: bool
    iterations: int
    rounds: int
    relaxed: float


class Planner:
    """Gauss-Newton sequential quadratic programming over the horizon.

    Args:
        platform: The machine.
        parameters: Of the controller.
        iterations: Most programs a plan; 1 linearises once.
        tolerance: A plan that changes no acceleration by more is the solution, m/s^2 and rad/s^2.
        function: Makes a faster one of the CasADi function; None to evaluate it as it is.
    """

    def __init__(
        self,
        platform: Platform,
        parameters: MpcParameters,
        iterations: int = 1,
        tolerance: float = 0.0,
        function: Any = None,
    ) -> None:
        self.grid = make_grid(parameters.nodes)
        self.perception = Perception(self.grid, parameters)
        self._linearised = Linearised(platform, len(self.grid.times), parameters.margins, function)
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
        plan = Plan(*self.grid.motion(position, rate, guess), guess)
        count = rounds = 0
        while True:
            solution = self._improve(plan, wanted, active, sensed)
            count, rounds, active = count + 1, rounds + solution.rounds, solution.active
            plan = _sum(plan, solution.change)
            largest = float(np.max(np.abs(solution.change.acceleration)))
            if not solution.solved or count >= self._iterations or largest <= self._tolerance:
                return Planned(plan, active, solution.solved, count, rounds, solution.relaxed)

    def _improve(self, plan: Plan, wanted: Floats, active: Rows, sensed: Floats | None) -> Solution:
        problem = self._problem
        about = self._linearised(plan.position, plan.rate, plan.acceleration)
        cost = problem.cost(plan, about, wanted, sensed)
        bounds = problem.bounds(self._linearised.lower, self._linearised.upper, wanted)
        return solve(problem, cost, about, bounds, active, self._rounds)


def _sum(plan: Plan, change: Plan) -> Plan:
    return Plan(
        plan.position + change.position, plan.rate + change.rate, plan.acceleration + change.acceleration
    )
