"""The optimum of a window of a drive: what the car does and how the machine moves at its start, to a plan."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace
from functools import cache, cached_property, lru_cache
from typing import Any, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...envs.cues import CueTrace
from ...envs.perception import VestibularModel
from ...envs.platform import Platform
from ...envs.simulator.simulator import N_AXES
from ..symbolic import SymbolicMachine
from .plan import Account, Plan, Played, Player
from .program import (
    N_CUES,
    OptimumOptions,
    SensedError,
    axis_bounds,
    interval,
    mean_accelerations,
    node_limits,
    sensed_error,
)
from .transcription import Blocks, OnIteration, Transcription, Watch, blocks_of

Floats = NDArray[np.float64]

_LEG_ACCELERATIONS: Final = 6
"""The last inequalities of a node: the only ones that its accelerations can still change at the start."""

_ACCEPTABLE: Final = {
    "acceptable_tol": 0.2,
    "acceptable_iter": 5,
    "acceptable_obj_change_tol": 1e-3,
    "acceptable_constr_viol_tol": 1e-3,
    "acceptable_dual_inf_tol": 0.5,
    "acceptable_compl_inf_tol": 0.01,
}
"""IPOPT also stops where the cost has stood still to a thousandth, and limits are kept to a millimeter."""

_CONVERGED: Final = ("Solve_Succeeded", "Solved_To_Acceptable_Level")


@dataclass(frozen=True)
class Solution:
    """What IPOPT came to.

    Args:
        nodes: (intervals + 1, node_size) variables.
        accelerations: (n, 9) of every time step of the window.
        costs: (intervals,) sum of squared errors of the samples of each.
        converged: Whether it is a minimum.
        iterations: IPOPT's.
        status: IPOPT's word for how it ended.
    """

    nodes: Floats
    accelerations: Floats
    costs: Floats
    converged: bool
    iterations: int
    status: str


@dataclass(frozen=True)
class Start:
    """The machine and its driver at the start of a window.

    Args:
        position: (9,) m and rad.
        rate: (9,).
        memory: (m,) states of the sensed error for the next sample, in indifference zones; empty for J.
    """

    position: Floats
    rate: Floats
    memory: Floats


class Parts(NamedTuple):
    """Functions of an interval, and the ranges of a node's inequalities."""

    blocks: Blocks
    lower: Floats
    upper: Floats


@lru_cache(maxsize=8)
def _parts(
    platform: Platform,
    options: OptimumOptions,
    vestibular: VestibularModel | None,
    dt: float,
    margin: float,
    clear: bool,
) -> Parts:
    """Made once for all drives on a machine; without a filter if there is no model of perception."""
    machine = SymbolicMachine(platform)
    sensed = None if vestibular is None else sensed_error(vestibular, dt)
    part = interval(machine, options, sensed, dt)
    spacing = options.steps * dt
    limits = node_limits(machine, part.q, part.v, part.a, spacing, options.margin, margin, clear)
    return Parts(blocks_of(part, limits, options), limits.lower, limits.upper)


class Problem:
    """Windows of drives on one machine.

    Args:
        platform: The machine.
        options: What to minimize, and how.
        vestibular: The driver's perception; None to take errors as they are.
        dt: Time step of the machine, s.
        margin: Share of the limits of speed and acceleration to keep free.
        clear: Whether to keep away from singular poses.
        tell: Called with IPOPT's iterations so far.
    """

    def __init__(
        self,
        platform: Platform,
        options: OptimumOptions,
        vestibular: VestibularModel | None,
        dt: float,
        margin: float,
        clear: bool = False,
        tell: OnIteration | None = None,
    ) -> None:
        self.options, self.dt, self.margin, self.clear = options, dt, margin, clear
        self._vestibular = vestibular
        self._machine = SymbolicMachine(platform)
        self._watch = Watch(tell)
        self.sensed: SensedError | None = None
        self._plain: Problem | None = None
        if vestibular is not None:
            self.sensed = sensed_error(vestibular, dt)
            self._plain = Problem(platform, options, None, dt, margin, clear, tell)
        self._transcriptions: dict[int, Transcription] = {}

    @cached_property
    def _parts(self) -> Parts:
        machine, options = self._machine.platform, self.options
        return _parts(machine, options, self._vestibular, self.dt, self.margin, self.clear)

    def solve(self, reference: Floats, start: Start) -> Solution:
        """The best accelerations for a window.

        Args:
            reference: (n, 6) force and rate of the car at the n samples after the start.
            start: Where the window begins.

        Raises:
            KeyboardInterrupt: Ctrl-C was pressed.
        """
        count = -(-len(reference) // self.options.steps)
        given = self._given(reference, count)
        program = self._transcription(count)
        lower, upper = self._bounds(count, start)
        least, most = self._ranges(program)
        guess, before = self._guess(reference, given, count, start)
        with self._watch.solving():
            result = program.solver(x0=guess, p=given, lbx=lower, ubx=upper, lbg=least, ubg=most)
        stats = program.solver.stats()
        x = np.array(result["x"])[:, 0]
        nodes = x.reshape(count + 1, -1)
        return Solution(
            nodes,
            mean_accelerations(nodes[:, -N_AXES:], self.options.steps)[: len(reference)],
            program.errors(x, given) * self.options.steps,
            stats["return_status"] in _CONVERGED,
            int(stats["iter_count"]) + before,
            str(stats["return_status"]),
        )

    def _transcription(self, count: int) -> Transcription:
        if count not in self._transcriptions:
            self._transcriptions[count] = Transcription(self._parts.blocks, count, self._ipopt(), self._watch)
        return self._transcriptions[count]

    def _ipopt(self) -> dict[str, Any]:
        options = self.options
        return {
            "tol": options.tolerance,
            "max_iter": options.iterations,
            "mu_init": 10.0 * options.barrier,
            "mu_target": options.barrier,
            "linear_solver": "mumps",
            **_ACCEPTABLE,
        }

    def _given(self, reference: Floats, count: int) -> Floats:
        """The car's cues at all samples, and whether they count; what is after the end does not."""
        rows = np.zeros((count * self.options.steps, N_CUES + 1))
        rows[: len(reference), :N_CUES] = reference
        rows[: len(reference), N_CUES] = 1.0
        return rows.ravel()

    def _guess(self, reference: Floats, given: Floats, count: int, start: Start) -> tuple[Floats, int]:
        """A motion without gaps, and the iterations it took.

        Standing still for errors as they are. What is sensed begins with the plan for those: from far off,
        its long memory would bend the way of the iterations.
        """
        nodes = np.zeros((count + 1, self._parts.blocks.node_size))
        nodes[:, :N_AXES] = start.position
        if self._plain is None:
            return nodes.ravel(), 0
        plain = self._plain.solve(reference, replace(start, memory=np.zeros(0)))
        nodes[:, : 2 * N_AXES], nodes[:, -N_AXES:] = np.split(plain.nodes, [2 * N_AXES], axis=1)
        nodes[0, 2 * N_AXES : -N_AXES] = start.memory
        rows = given.reshape(count, self.options.steps, N_CUES + 1)
        for k in range(count):
            z = np.concatenate([nodes[k], nodes[k + 1, -N_AXES:]])
            end = np.array(self._parts.blocks.end(z, rows[k].T))[:, 0]
            nodes[k + 1, 2 * N_AXES : -N_AXES] = end[2 * N_AXES :]
        return nodes.ravel(), plain.iterations

    def _bounds(self, count: int, start: Start) -> tuple[Floats, Floats]:
        """Of the variables: the start is given, carriage and turntable have limits of their own."""
        most = np.full((count + 1, self._parts.blocks.node_size), np.inf)
        speed, acceleration = axis_bounds(self._machine, self.margin)
        most[:, N_AXES : 2 * N_AXES] = speed
        most[:, -N_AXES:] = acceleration
        lower, upper = -most, most
        state = np.concatenate([start.position, start.rate, start.memory])
        lower[0, : len(state)] = upper[0, : len(state)] = state
        return lower.ravel(), upper.ravel()

    def _ranges(self, program: Transcription) -> tuple[Floats, Floats]:
        """Of the constraints: no gaps, and the limits."""
        ranges = []
        for limit in (self._parts.lower, self._parts.upper):
            nodes = np.tile(limit, (program.intervals + 1, 1))
            nodes[0, :-_LEG_ACCELERATIONS] = np.sign(limit[-1]) * np.inf
            ranges.append(np.concatenate([np.zeros(program.gaps), nodes.ravel()]))
        return ranges[0], ranges[1]


# A drive of any length in windows: each looks ahead beyond what is kept of it.
#
# The last window reaches to the end of the drive. Every plan is played through the machine's own step before
# it is taken; one that meets a limit between nodes is solved anew with a wider margin, one that comes near a
# singular pose with those forbidden.


OnWindow = Callable[[float, int], None]

_WIDER: Final = 3.0
"""From one margin to the next."""


class Window(NamedTuple):
    """Time steps of a drive: planned from ``first`` to ``last``, kept to ``kept``."""

    first: int
    kept: int
    last: int


def windows(steps: int, options: OptimumOptions, dt: float) -> Iterator[Window]:
    """The windows of a drive of some time steps; they begin at nodes."""
    spacing = options.steps * dt
    length = max(round(options.window / spacing), 1) * options.steps
    kept = max(round(options.keep / spacing), 1) * options.steps
    first = 0
    while first + length < steps:
        yield Window(first, first + kept, first + length)
        first += kept
    yield Window(first, steps, steps)


@dataclass
class _Tally:
    """What an account counts; ``played`` holds the cost of every time step, window by window."""

    cost: float = 0.0
    windows: int = 0
    iterations: int = 0
    widened: int = 0
    unconverged: int = 0
    braked: int = 0
    played: list[Floats] = field(default_factory=list)


class Planner:
    """Plans one drive on one machine.

    Args:
        platform: The machine.
        options: The problem.
        vestibular: The driver's perception.
        cues: The drive, at the machine's time step.
        start: (9,) pose at its first sample.
        tell: Called with the share of the drive that is planned and IPOPT's iterations in this window.
    """

    def __init__(
        self,
        platform: Platform,
        options: OptimumOptions,
        vestibular: VestibularModel,
        cues: CueTrace,
        start: Floats,
        tell: OnWindow | None = None,
    ) -> None:
        self._options, self._cues, self._start = options, cues, start
        self._player = Player(platform, cues, vestibular, start)
        self._share, self._tally = 0.0, _Tally()
        head = platform.cab.head
        force = cues.specific_force if options.objective == "J" else cues.at_point(head)
        self._reference = np.hstack([force, cues.angular_velocity])
        self._zones = np.repeat([options.force_zone, options.rate_zone], 3)

        def told(iterations: int) -> None:
            if tell is not None:
                tell(self._share, iterations)

        @cache
        def problem(margin: float, clear: bool = False) -> Problem:
            filtered = vestibular if options.objective == "perceived" else None
            return Problem(platform, options, filtered, cues.dt, margin, clear, told if tell else None)

        self._problem = problem

    def plan(self) -> Plan:
        """The plan of the whole drive."""
        began, steps = time.perf_counter(), len(self._cues) - 1
        first = self._costs(np.array([self._player.state]))[0]
        kept = []
        for window in windows(steps, self._options, self._cues.dt):
            self._share = window.first / steps
            played = self._solved(window)
            self._tally.windows += 1
            self._tally.played.append(self._costs(played.states))
            kept.append(played.accelerations)
        tally = self._tally
        account = Account(
            objective=self._options.objective,
            claimed=float((first + tally.cost) / (steps + 1)),
            played=float((first + np.concatenate(tally.played).sum()) / (steps + 1)),
            windows=tally.windows,
            iterations=tally.iterations,
            widened=tally.widened,
            unconverged=tally.unconverged,
            braked=tally.braked,
            seconds=time.perf_counter() - began,
        )
        return Plan(np.concatenate(kept), self._start, account)

    def _solved(self, window: Window) -> Played:
        """The kept part of a window; braking where no plan keeps the limits."""
        tally, options = self._tally, self._options
        before, begins = self._player.snapshot(), self._begins()
        ahead = self._reference[window.first + 1 : window.last + 1]
        length = window.kept - window.first
        margin, clear = options.margin, False
        for attempt in range(options.widenings + 1):
            solution = self._problem(margin, clear).solve(ahead, begins)
            tally.iterations += solution.iterations
            played = self._player.play(solution.accelerations[:length])
            if played.clean:
                tally.unconverged += not solution.converged
                tally.cost += float(solution.costs[: -(-length // options.steps)].sum())
                return played
            self._player.restore(before)
            if played.singular and not clear:
                clear = True
            else:
                margin *= _WIDER
            tally.widened += attempt < options.widenings
        tally.unconverged += not solution.converged
        tally.braked += 1
        played = self._player.brake(length)
        tally.cost += float(self._costs(played.states).sum())
        return played

    def _begins(self) -> Start:
        """The machine and the driver now."""
        state, sensed = self._player.state, self._problem(self._options.margin).sensed
        memory = np.zeros(0)
        if sensed is not None:
            simulated, reference = state["simulator_cue"], state["reference_cue"]
            difference = (
                simulated["head_force"] - reference["head_force"],
                simulated["rate"] - reference["rate"],
            )
            error = np.concatenate(difference) / self._zones
            filters = (
                state["vestibular_simulator"]["otoliths"] - state["vestibular_reference"]["otoliths"],
                state["vestibular_simulator"]["canals"] - state["vestibular_reference"]["canals"],
            )
            memory = sensed.ahead(np.vstack(filters) / self._zones[:, None], error)
        return Start(self._player.positions(), self._player.rates(), memory)

    def _costs(self, states: NDArray[np.void]) -> Floats:
        """(n,) squared errors of the cues, or of the perceived cues, in indifference zones."""
        perceived = self._options.objective == "perceived"
        simulated = states["perceived_simulator" if perceived else "simulator_cue"]
        reference = states["perceived_reference" if perceived else "reference_cue"]
        errors = (
            np.hstack([simulated["force"] - reference["force"], simulated["rate"] - reference["rate"]])
            / self._zones
        )
        return np.asarray(np.sum(errors**2, axis=1), dtype=np.float64)
