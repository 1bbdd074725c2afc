"""The optimum of a window of a drive: what the car does and how the machine moves at its start, to a plan."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from typing import Any, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...envs.perception import VestibularModel
from ...envs.platform import Platform
from ...envs.simulator import N_AXES
from ..symbolic import SymbolicMachine
from .blocks import Blocks, blocks_of
from .interval import N_CUES, interval, mean_accelerations
from .limits import axis_bounds, node_limits
from .listener import Tell, Watch
from .options import OptimumOptions
from .perception import SensedError, sensed_error
from .transcription import Transcription

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
"""IPOPT also stops where the cost has stood still to a thousandth, and limits are kept to a millimetre."""

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
        options: What to minimise, and how.
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
        tell: Tell | None = None,
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

    def solve(self, wanted: Floats, start: Start) -> Solution:
        """The best accelerations for a window.

        Args:
            wanted: (n, 6) force and rate of the car at the n samples after the start.
            start: Where the window begins.

        Raises:
            KeyboardInterrupt: Ctrl-C was pressed.
        """
        count = -(-len(wanted) // self.options.steps)
        given = self._given(wanted, count)
        program = self._transcription(count)
        lower, upper = self._bounds(count, start)
        least, most = self._ranges(program)
        guess, before = self._guess(wanted, given, count, start)
        with self._watch.solving():
            result = program.solver(x0=guess, p=given, lbx=lower, ubx=upper, lbg=least, ubg=most)
        stats = program.solver.stats()
        x = np.array(result["x"])[:, 0]
        nodes = x.reshape(count + 1, -1)
        return Solution(
            nodes,
            mean_accelerations(nodes[:, -N_AXES:], self.options.steps)[: len(wanted)],
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

    def _given(self, wanted: Floats, count: int) -> Floats:
        """The car's cues at all samples, and whether they count; what is after the end does not."""
        rows = np.zeros((count * self.options.steps, N_CUES + 1))
        rows[: len(wanted), :N_CUES] = wanted
        rows[: len(wanted), N_CUES] = 1.0
        return rows.ravel()

    def _guess(self, wanted: Floats, given: Floats, count: int, start: Start) -> tuple[Floats, int]:
        """A motion without gaps, and the iterations it took.

        Standing still for errors as they are. What is sensed begins with the plan for those: from far off,
        its long memory would bend the way of the iterations.
        """
        nodes = np.zeros((count + 1, self._parts.blocks.node_size))
        nodes[:, :N_AXES] = start.position
        if self._plain is None:
            return nodes.ravel(), 0
        plain = self._plain.solve(wanted, replace(start, memory=np.zeros(0)))
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
