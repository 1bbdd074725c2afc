"""A drive of any length in windows: each looks ahead beyond what is kept of it.

The last window reaches to the end of the drive. Every plan is played through the machine's own step before
it is taken; one that meets a limit between nodes is solved anew with a wider margin, one that comes near a
singular pose with those forbidden.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from functools import cache
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...envs.cues import CueTrace
from ...envs.perception import VestibularModel
from ...envs.platform import Platform
from .options import OptimumOptions
from .plan import Account, Plan
from .player import Played, Player
from .problem import Problem, Start

Floats = NDArray[np.float64]
Tell = Callable[[float, int], None]

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
        tell: Tell | None = None,
    ) -> None:
        self._options, self._cues, self._start = options, cues, start
        self._player = Player(platform, cues, vestibular, start)
        self._share, self._tally = 0.0, _Tally()
        head = platform.cab.head
        force = cues.specific_force if options.objective == "J" else cues.at_point(head)
        self._wanted = np.hstack([force, cues.angular_velocity])
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
        ahead = self._wanted[window.first + 1 : window.last + 1]
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
            felt, wanted = state["felt"], state["wanted"]
            difference = (felt["head_force"] - wanted["head_force"], felt["rate"] - wanted["rate"])
            error = np.concatenate(difference) / self._zones
            filters = (
                state["vestibular_felt"]["otoliths"] - state["vestibular_wanted"]["otoliths"],
                state["vestibular_felt"]["canals"] - state["vestibular_wanted"]["canals"],
            )
            memory = sensed.ahead(np.vstack(filters) / self._zones[:, None], error)
        return Start(self._player.positions(), self._player.rates(), memory)

    def _costs(self, states: NDArray[np.void]) -> Floats:
        """(n,) squared errors in indifference zones, of what is felt or of what is sensed."""
        own = "" if self._options.objective == "J" else "sensed_"
        felt, wanted = states[f"{own}felt"], states[f"{own}wanted"]
        errors = np.hstack([felt["force"] - wanted["force"], felt["rate"] - wanted["rate"]]) / self._zones
        return np.asarray(np.sum(errors**2, axis=1), dtype=np.float64)
