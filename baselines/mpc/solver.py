r"""The quadratic program of a plan, its solution by an active set, and the sequence of such programs.

The unknowns z are the changes of the accelerations at the n nodes, one column for every axis that moves, flat
by node. About a motion with cues y and their derivatives Y by z, the cost is the mean over the horizon of the
squared cue error in indifference zones, as J, and of the weighted motion:

    min_z  1/2 sum_j w_j ( |y_j + Y_j z - r_j|^2 + |q_j|^2_P + |v_j|^2_R + |a_j|^2_S ) + end terms
    s.t.   lower_j <= h_j + H_j z <= upper_j  at every node j,

with r the reference cue, w_j the weights of the trapezoidal rule and h the limit rows. For the perceived
objective the errors go through the vestibular response first. The Hessian is Gauss-Newton's. The violation of
every limit has a price, so the program always has a solution.

**Solution.** Without limits the minimum is a Cholesky factorization away. Rows that it violates, and rows
that held last time, get multipliers. With H = L L' and M = L^-1 A' of their rows A, the dual program

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
from ...envs.platform import Platform, actuator_limits
from ...envs.simulator.simulator import N_AXES
from .parameters import AxisWeights, MpcParameters
from .prediction import (
    N_CUES,
    Floats,
    Grid,
    Linearization,
    MachineModel,
    PerceivedError,
    cue_scales,
    make_grid,
)

try:
    import daqp as _daqp
except ImportError:
    raise ConfigurationError(
        "this controller needs the solver DAQP, which is not installed: "
        "pip install 'motion-cueing-gym[optimal]'"
    ) from None

daqp: Any = _daqp

_TILT: slice = slice(3, 5)
"""Rows of the cab's roll and pitch rate among the cues."""


@dataclass(frozen=True)
class Motion:
    """Motion at n nodes, (n, 9) each: positions, rates and accelerations."""

    position: Floats
    rate: Floats
    acceleration: Floats


@dataclass(frozen=True)
class QuadraticCost:
    """1/2 z'Hz + g'z over z (m,) for ``hessian`` (m, m) and ``gradient`` (m,)."""

    hessian: Floats
    gradient: Floats


@dataclass(frozen=True)
class Bounds:
    """Bounds of the linearized rows, each (n, k), infinite where there is none.

    Args:
        lower: Least values.
        upper: Greatest values.
        price: Linear cost of a violation (exact penalty); infinite where ``softness`` applies.
        softness: Reciprocal of the quadratic cost of a violation; 0 where ``price`` applies.
    """

    lower: Floats
    upper: Floats
    price: Floats
    softness: Floats


class HorizonProgram:
    """Builds the quadratic program for one machine and one set of parameters.

    Args:
        platform: The machine.
        parameters: Of the controller.
        grid: Its nodes.
        perceived: (6, n, n) from the error of each cue at the nodes to the perceived error there, or None.

    Attributes:
        axes: Axes that move, in the order of ``AXES``.
        size: Number of unknowns.
        motion_weights: (k, 3, n, n) on positions, rates and accelerations at the nodes, by moving axis.
    """

    def __init__(
        self, platform: Platform, parameters: MpcParameters, grid: Grid, perceived: Floats | None = None
    ) -> None:
        self.grid, self._parameters, self._perceived = grid, parameters, perceived
        self._cab_share = np.sqrt(parameters.cab_share)
        self.axes = moving_axes(platform)
        n, k = len(grid.times), len(self.axes)
        self.size = n * k
        weights = [_axis_weights(platform, parameters)[axis] for axis in self.axes]
        self.motion_weights = np.array([_motion_terms(grid, w) for w in weights])
        hessian = np.zeros((n, k, n, k))
        for i, (position, rate, acceleration) in enumerate(self.motion_weights):
            hessian[:, i, :, i] = (
                grid.position.T @ position @ grid.position + grid.rate.T @ rate @ grid.rate + acceleration
            )
        self._regular = hessian.reshape(n * k, n * k)
        self._scale = np.sqrt(grid.weights)[:, None]

    def cost(
        self, motion: Motion, about: Linearization, reference: Floats, free_response: Floats | None
    ) -> QuadraticCost:
        """Cost about a motion, with the reference cue (n, 6), SI.

        ``free_response`` (n, 6) is the perceived error that past errors leave, in zones; None for none.
        """
        slope = self.condensed(about.slopes[:, :N_CUES])
        if self._perceived is not None:
            perceived = np.matmul(self._perceived, slope.transpose(1, 0, 2)).transpose(1, 0, 2)
            slope = np.concatenate([perceived, self._cab_share * slope], axis=1)
        residual = (self._scale * self._error(about, reference, free_response)).ravel()
        jacobian = (self._scale[:, :, None] * slope).reshape(len(residual), -1)
        return QuadraticCost(
            self._regular + jacobian.T @ jacobian, self._motion_gradient(motion) + residual @ jacobian
        )

    def merit(
        self,
        motion: Motion,
        about: Linearization,
        reference: Floats,
        free_response: Floats | None,
        bounds: Bounds,
    ) -> float:
        """Exact cost of a motion, with the price of every limit it exceeds (merit function of the search)."""
        error = self._scale * self._error(about, reference, free_response)
        excess = np.maximum(np.maximum(about.values - bounds.upper, bounds.lower - about.values), 0.0)
        hard, soft = np.isfinite(bounds.price), bounds.softness > 0.0
        squares = np.sum(error**2) + np.sum(excess[soft] ** 2 / bounds.softness[soft])
        priced = bounds.price[hard] @ excess[hard]
        return float(0.5 * (squares + self._motion_cost(motion)) + priced)

    def _error(self, about: Linearization, reference: Floats, free_response: Floats | None) -> Floats:
        """(n, 6) error of the cues in zones; (n, 12) perceived error and a share of the cues' own."""
        error = about.values[:, :N_CUES] - reference / cue_scales()
        if self._perceived is None:
            return np.asarray(error)
        perceived = np.einsum("cji,ic->jc", self._perceived, error)
        if free_response is not None:
            perceived = perceived + free_response
        return np.hstack([perceived, self._cab_share * error])

    def condensed(self, slopes: Floats) -> Floats:
        """(n, r, m) derivatives of rows by the unknowns, from those by their node's motion (n, r, 27)."""
        n, rows = slopes.shape[:2]
        q, v, a = (slopes[:, :, N_AXES * i : N_AXES * (i + 1)][:, :, self.axes][:, :, None] for i in range(3))
        whole = q * self.grid.position[:, None, :, None] + v * self.grid.rate[:, None, :, None]
        nodes = np.arange(n)
        whole[nodes, :, nodes] += a[:, :, 0]
        return np.asarray(whole.reshape(n, rows, -1))

    def rows(self, slopes: Floats, chosen: NDArray[np.intp]) -> Floats:
        """(r, m) derivatives by the unknowns of chosen rows, numbered flat by node."""
        node, row = np.divmod(chosen, slopes.shape[1])
        picked = slopes[node, row].reshape(len(chosen), 3, N_AXES)[:, :, self.axes]
        q, v, a = picked[:, 0, None], picked[:, 1, None], picked[:, 2]
        whole = q * self.grid.position[node][:, :, None] + v * self.grid.rate[node][:, :, None]
        whole[np.arange(len(chosen)), node] += a
        return np.asarray(whole.reshape(len(chosen), -1))

    def change(self, unknowns: Floats) -> Motion:
        """Change of the motion that unknowns (m,) make."""
        acceleration = np.zeros((len(self.grid.times), N_AXES))
        acceleration[:, self.axes] = unknowns.reshape(-1, len(self.axes))
        return Motion(self.grid.position @ acceleration, self.grid.rate @ acceleration, acceleration)

    def bounds(self, lower: Floats, upper: Floats, reference: Floats) -> Bounds:
        """Bounds of every row: the machine's limits, and the tilt rate in excess of the car's own.

        Args:
            lower: (k - 6,) least values of the limit rows.
            upper: (k - 6,) greatest values.
            reference: (n, 6) reference cue, SI.
        """
        p, n = self._parameters, len(reference)
        free = np.full((n, N_CUES), np.inf)
        low, high, softness = -free, free.copy(), np.zeros((n, N_CUES))
        if p.tilt_rate.weight > 0.0:
            scale = cue_scales()[_TILT]
            own, limit = reference[:, _TILT] / scale, p.tilt_rate.limit / scale
            low[:, _TILT] = np.minimum(own, 0.0) - limit
            high[:, _TILT] = np.maximum(own, 0.0) + limit
            softness[:, _TILT] = 1.0 / (p.tilt_rate.weight * self.grid.weights[:, None])
        tiled = np.ones((n, 1))
        price = p.penalty * self.grid.weights[:, None] * np.ones((n, len(lower)))
        return Bounds(
            np.hstack([low, tiled * lower]),
            np.hstack([high, tiled * upper]),
            np.hstack([free, price]),
            np.hstack([softness, np.zeros((n, len(lower)))]),
        )

    def _motion_cost(self, motion: Motion) -> float:
        weighted = self._weighted(motion)
        return float(sum(np.sum(x[:, self.axes] * w) for x, w in zip(_parts(motion), weighted, strict=True)))

    def _motion_gradient(self, motion: Motion) -> Floats:
        q, v, a = self._weighted(motion)
        return np.asarray((self.grid.position.T @ q + self.grid.rate.T @ v + a).ravel())

    def _weighted(self, motion: Motion) -> list[Floats]:
        """Positions, rates and accelerations (n, k) times their weights."""
        return [
            (self.motion_weights[:, i] @ x[:, self.axes].T[:, :, None])[:, :, 0].T
            for i, x in enumerate(_parts(motion))
        ]


def _parts(motion: Motion) -> tuple[Floats, Floats, Floats]:
    return motion.position, motion.rate, motion.acceleration


def moving_axes(platform: Platform) -> NDArray[np.intp]:
    """Axes of the subsystems that a machine has."""
    limits = actuator_limits(platform)
    return np.flatnonzero(limits["position_max"] > limits["position_min"])


def _axis_weights(platform: Platform, parameters: MpcParameters) -> list[AxisWeights]:
    """Weights by axis, in the order of ``AXES``. An unlimited turntable has no neutral angle to leave."""
    w = parameters.weights
    turntable = w.turntable
    if platform.turntable is not None and platform.turntable.travel is None:
        turntable = AxisWeights(0.0, turntable.rate, turntable.acceleration, 0.0, turntable.end_rate)
    return [w.carriage] * 2 + [w.translation] * 3 + [w.tilt] * 2 + [w.yaw, turntable]


def _motion_terms(grid: Grid, w: AxisWeights) -> Floats:
    """(3, n, n) weights on positions, rates and accelerations at the nodes."""
    along = np.diag(grid.weights)
    end = np.zeros_like(along)
    end[-1, -1] = 1.0 / grid.times[-1]
    return np.array(
        [w.position * along + w.end_position * end, w.rate * along + w.end_rate * end, w.acceleration * along]
    )


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

    ``guess`` are rows that may be active, as ``QpSolution.active``; ``rounds`` limits the dual programs.
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
    program: HorizonProgram, about: Linearization, bounds: Bounds, factor: Floats, free: Floats, working: Rows
) -> tuple[Floats, Floats] | None:
    """Unknowns and multipliers under the working rows; None where the solver gives up.

    ``factor`` is L of the Hessian, ``free`` (m,) the minimum without rows.
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
    """Gauss-Newton sequential quadratic programming over the horizon."""

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
