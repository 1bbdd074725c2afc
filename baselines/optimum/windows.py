"""The solve: a window of a drive by IPOPT, and a drive of any length by windows that overlap.

Each window looks beyond the part of it that is applied (receding horizon); the last one reaches to the end of
the drive. Every plan is played through the machine's own step before it is taken. A plan that meets a limit
between nodes is solved again with a wider margin, one that comes near a singular pose with a limit on
clearance. Where no plan keeps the limits, the machine brakes.
"""

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
from .plan import Plan, PlanReport, Playback, Player
from .program import (
    N_CUES,
    OptimumOptions,
    PerceivedErrorFilter,
    axis_bounds,
    interval,
    mean_accelerations,
    node_limits,
    perceived_error_filter,
)
from .transcription import Blocks, OnIteration, SolveMonitor, Transcription, blocks_of

Floats = NDArray[np.float64]

_LEG_ACCELERATIONS: Final = 6
"""Last inequalities of a node: at the start of a window, accelerations can change no others."""

_ACCEPTABLE: Final = {
    "acceptable_tol": 0.2,
    "acceptable_iter": 5,
    "acceptable_obj_change_tol": 1e-3,
    "acceptable_constr_viol_tol": 1e-3,
    "acceptable_dual_inf_tol": 0.5,
    "acceptable_compl_inf_tol": 0.01,
}
"""IPOPT also stops where the cost has stood still to a thousandth, and limits are kept to a millimeter."""

_SHAPING: Final = ("objective", "steps", "force_zone", "rate_zone", "effort", "margin")
"""Options that the functions of an interval depend on; programs that differ in others share them."""

_CONVERGED: Final = ("Solve_Succeeded", "Solved_To_Acceptable_Level")


@dataclass(frozen=True)
class WindowSolution:
    """Solution of a window.

    Args:
        nodes: (intervals + 1, node_size) variables.
        accelerations: (n, 9) of every time step of the window.
        costs: (intervals,) sum of squared errors of the samples of each.
        converged: Whether it is a minimum.
        iterations: IPOPT's.
        status: IPOPT's return status.
    """

    nodes: Floats
    accelerations: Floats
    costs: Floats
    converged: bool
    iterations: int
    status: str


@dataclass(frozen=True)
class WindowStart:
    """State of machine and vestibular filters at the start of a window.

    Args:
        position: (9,) m and rad.
        rate: (9,).
        memory: (m,) states of the perceived error for the next sample, in indifference zones; empty for J.
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
    perceived = None if vestibular is None else perceived_error_filter(vestibular, dt)
    part = interval(machine, options, perceived, dt)
    spacing = options.steps * dt
    limits = node_limits(machine, part.q, part.v, part.a, spacing, options.margin, margin, clear)
    return Parts(blocks_of(part, limits, options), limits.lower, limits.upper)


class WindowProgram:
    """The nonlinear program of windows on one machine.

    Args:
        platform: The machine.
        options: Of the problem and the solver.
        vestibular: The driver's perception; None to take errors as they are.
        dt: Time step of the machine, s.
        margin: Share of the limits of speed and acceleration to keep free.
        clear: Whether to keep away from singular poses.
        on_iteration: Called with IPOPT's iterations so far.
    """

    def __init__(
        self,
        platform: Platform,
        options: OptimumOptions,
        vestibular: VestibularModel | None,
        dt: float,
        margin: float,
        clear: bool = False,
        on_iteration: OnIteration | None = None,
    ) -> None:
        self.options, self.dt, self.margin, self.clear = options, dt, margin, clear
        self._vestibular = vestibular
        self._machine = SymbolicMachine(platform)
        self._monitor = SolveMonitor(on_iteration)
        self.perceived: PerceivedErrorFilter | None = None
        self._plain: WindowProgram | None = None
        if vestibular is not None:
            self.perceived = perceived_error_filter(vestibular, dt)
            self._plain = WindowProgram(platform, options, None, dt, margin, clear, on_iteration)
        self._transcriptions: dict[int, Transcription] = {}

    @cached_property
    def _parts(self) -> Parts:
        shaping = {name: getattr(self.options, name) for name in _SHAPING}
        options = OptimumOptions(**shaping)
        return _parts(self._machine.platform, options, self._vestibular, self.dt, self.margin, self.clear)

    def solve(self, reference: Floats, start: WindowStart) -> WindowSolution:
        """The best accelerations for a window.

        Args:
            reference: (n, 6) force and rate of the car at the n samples after the start.
            start: Where the window begins.

        Raises:
            KeyboardInterrupt: Ctrl-C was pressed.
        """
        count = -(-len(reference) // self.options.steps)
        cues = self._cues(reference, count)
        program = self._transcription(count)
        lower, upper = self._bounds(count, start)
        least, most = self._ranges(program)
        guess, before = self._guess(reference, cues, count, start)
        with self._monitor.solving():
            result = program.solver(x0=guess, p=cues, lbx=lower, ubx=upper, lbg=least, ubg=most)
        stats = program.solver.stats()
        x = np.array(result["x"])[:, 0]
        nodes = x.reshape(count + 1, -1)
        return WindowSolution(
            nodes,
            mean_accelerations(nodes[:, -N_AXES:], self.options.steps)[: len(reference)],
            program.errors(x, cues) * self.options.steps,
            stats["return_status"] in _CONVERGED,
            int(stats["iter_count"]) + before,
            str(stats["return_status"]),
        )

    def _transcription(self, count: int) -> Transcription:
        if count not in self._transcriptions:
            self._transcriptions[count] = Transcription(
                self._parts.blocks, count, self._ipopt(), self._monitor
            )
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

    def _cues(self, reference: Floats, count: int) -> Floats:
        """Reference cue at all samples, and 1; or 0 after the end of the drive, where errors do not count."""
        rows = np.zeros((count * self.options.steps, N_CUES + 1))
        rows[: len(reference), :N_CUES] = reference
        rows[: len(reference), N_CUES] = 1.0
        return rows.ravel()

    def _guess(self, reference: Floats, cues: Floats, count: int, start: WindowStart) -> tuple[Floats, int]:
        """A motion without gaps to begin with, and the iterations it took.

        It stands still for the objective J. The perceived objective begins with the optimum of J: from far
        off, the long memory of the filters would mislead the iterations.
        """
        nodes = np.zeros((count + 1, self._parts.blocks.node_size))
        nodes[:, :N_AXES] = start.position
        if self._plain is None:
            return nodes.ravel(), 0
        plain = self._plain.solve(reference, replace(start, memory=np.zeros(0)))
        nodes[:, : 2 * N_AXES], nodes[:, -N_AXES:] = np.split(plain.nodes, [2 * N_AXES], axis=1)
        nodes[0, 2 * N_AXES : -N_AXES] = start.memory
        rows = cues.reshape(count, self.options.steps, N_CUES + 1)
        for k in range(count):
            z = np.concatenate([nodes[k], nodes[k + 1, -N_AXES:]])
            end = np.array(self._parts.blocks.end(z, rows[k].T))[:, 0]
            nodes[k + 1, 2 * N_AXES : -N_AXES] = end[2 * N_AXES :]
        return nodes.ravel(), plain.iterations

    def _bounds(self, count: int, start: WindowStart) -> tuple[Floats, Floats]:
        """Bounds of the variables: the start is given, carriage and turntable have limits of their own."""
        most = np.full((count + 1, self._parts.blocks.node_size), np.inf)
        speed, acceleration = axis_bounds(self._machine, self.margin)
        most[:, N_AXES : 2 * N_AXES] = speed
        most[:, -N_AXES:] = acceleration
        lower, upper = -most, most
        state = np.concatenate([start.position, start.rate, start.memory])
        lower[0, : len(state)] = upper[0, : len(state)] = state
        return lower.ravel(), upper.ravel()

    def _ranges(self, program: Transcription) -> tuple[Floats, Floats]:
        """Ranges of the constraints: no gaps, and the limits."""
        ranges = []
        for limit in (self._parts.lower, self._parts.upper):
            nodes = np.tile(limit, (program.intervals + 1, 1))
            nodes[0, :-_LEG_ACCELERATIONS] = np.sign(limit[-1]) * np.inf
            ranges.append(np.concatenate([np.zeros(program.gaps), nodes.ravel()]))
        return ranges[0], ranges[1]


OnWindow = Callable[[float, int], None]

_WIDER: Final = 3.0
"""From one margin to the next."""


class Window(NamedTuple):
    """Time steps of a drive: planned from ``first`` to ``last``, applied up to ``applied``."""

    first: int
    applied: int
    last: int


def windows(steps: int, options: OptimumOptions, dt: float) -> Iterator[Window]:
    """The windows of a drive of some time steps; they begin at nodes."""
    spacing = options.steps * dt
    length = max(round(options.window / spacing), 1) * options.steps
    applied = max(round(options.keep / spacing), 1) * options.steps
    first = 0
    while first + length < steps:
        yield Window(first, first + applied, first + length)
        first += applied
    yield Window(first, steps, steps)


@dataclass
class _Counts:
    """Sums of a report; ``played`` holds the cost of every time step, window by window."""

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
        on_window: Called with the share of the drive that is planned and IPOPT's iterations in this window.
    """

    def __init__(
        self,
        platform: Platform,
        options: OptimumOptions,
        vestibular: VestibularModel,
        cues: CueTrace,
        start: Floats,
        on_window: OnWindow | None = None,
    ) -> None:
        self._options, self._cues, self._start = options, cues, start
        self._player = Player(platform, cues, vestibular, start)
        self._share, self._counts = 0.0, _Counts()
        head = platform.cab.head
        force = cues.specific_force if options.objective == "J" else cues.at_point(head)
        self._reference = np.hstack([force, cues.angular_velocity])
        self._zones = np.repeat([options.force_zone, options.rate_zone], 3)

        def on_iteration(iterations: int) -> None:
            if on_window is not None:
                on_window(self._share, iterations)

        @cache
        def program(margin: float, clear: bool = False) -> WindowProgram:
            filtered = vestibular if options.objective == "perceived" else None
            callback = on_iteration if on_window else None
            return WindowProgram(platform, options, filtered, cues.dt, margin, clear, callback)

        self._program = program

    def plan(self) -> Plan:
        """The plan of the whole drive."""
        began, steps = time.perf_counter(), len(self._cues) - 1
        first = self._costs(np.array([self._player.state]))[0]
        applied = []
        for window in windows(steps, self._options, self._cues.dt):
            self._share = window.first / steps
            played = self._solved(window)
            self._counts.windows += 1
            self._counts.played.append(self._costs(played.states))
            applied.append(played.accelerations)
        counts = self._counts
        report = PlanReport(
            objective=self._options.objective,
            claimed=float((first + counts.cost) / (steps + 1)),
            played=float((first + np.concatenate(counts.played).sum()) / (steps + 1)),
            windows=counts.windows,
            iterations=counts.iterations,
            widened=counts.widened,
            unconverged=counts.unconverged,
            braked=counts.braked,
            seconds=time.perf_counter() - began,
        )
        return Plan(np.concatenate(applied), self._start, report)

    def _solved(self, window: Window) -> Playback:
        """The applied part of a window; braking where no plan keeps the limits."""
        counts, options = self._counts, self._options
        before, begins = self._player.snapshot(), self._window_start()
        reference = self._reference[window.first + 1 : window.last + 1]
        length = window.applied - window.first
        margin, clear = options.margin, False
        for attempt in range(options.widenings + 1):
            solution = self._program(margin, clear).solve(reference, begins)
            counts.iterations += solution.iterations
            played = self._player.play(solution.accelerations[:length])
            if played.clean:
                counts.unconverged += not solution.converged
                counts.cost += float(solution.costs[: -(-length // options.steps)].sum())
                return played
            self._player.restore(before)
            if played.singular and not clear:
                clear = True
            else:
                margin *= _WIDER
            counts.widened += attempt < options.widenings
        counts.unconverged += not solution.converged
        counts.braked += 1
        played = self._player.brake(length)
        counts.cost += float(self._costs(played.states).sum())
        return played

    def _window_start(self) -> WindowStart:
        """Machine and vestibular filters now."""
        state, perceived = self._player.state, self._program(self._options.margin).perceived
        memory = np.zeros(0)
        if perceived is not None:
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
            memory = perceived.next_state(np.vstack(filters) / self._zones[:, None], error)
        return WindowStart(self._player.positions(), self._player.rates(), memory)

    def _costs(self, states: NDArray[np.void]) -> Floats:
        """(n,) squared errors of the cues, or of the perceived cues, in indifference zones."""
        kind = ("perceived_simulator", "perceived_reference"), ("simulator_cue", "reference_cue")
        simulated, reference = (states[name] for name in kind[self._options.objective == "J"])
        errors = (
            np.hstack([simulated["force"] - reference["force"], simulated["rate"] - reference["rate"]])
            / self._zones
        )
        return np.asarray(np.sum(errors**2, axis=1), dtype=np.float64)
