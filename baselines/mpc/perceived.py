"""The perceived error over the horizon: what a vestibular model makes of the error of the cues.

Canals and otoliths are linear, so what is sensed of an error is the error filtered. For an error that is
a straight line between nodes, the filter's response at the nodes is a matrix, and the memory of what was
felt before another.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.linalg import expm
from scipy.signal import tf2ss

from ...envs.perception import get_vestibular_model
from ...envs.perception.models import VestibularModel
from ...envs.simulator import TIME_STEP
from .grid import Grid
from .linearisation import N_CUES, Floats, cue_scales
from .parameters import MpcParameters

_ORDER = 3
"""States of a filter; lower orders are padded with zeros."""


@dataclass(frozen=True)
class Ramp:
    """x_1 = a x_0 + begin u_0 + end u_1, y_1 = c x_1 + d u_1: exact for a straight line from u_0 to u_1."""

    a: Floats
    begin: Floats
    end: Floats
    c: Floats
    d: float


class Perception:
    """Filters of the six cues' errors.

    Args:
        grid: The nodes.
        parameters: With the objective; for "cab" there is nothing to filter.

    Attributes:
        response: (6, n, n) from errors at the nodes to sensed errors there; None for "cab".
    """

    def __init__(self, grid: Grid, parameters: MpcParameters) -> None:
        self.response: Floats | None = None
        if parameters.objective == "cab":
            return
        model = get_vestibular_model(parameters.vestibular)
        systems = [_system(model, cue) for cue in range(N_CUES)]
        steps = np.diff(grid.times, prepend=0.0)
        over_nodes = [_over(system, steps) for system in systems]
        self.response = np.array([response for response, _ in over_nodes])
        self._memory = np.array([memory for _, memory in over_nodes])
        self._steps = [_ramp(system, TIME_STEP) for system in systems]

    def start(self) -> Floats:
        """(6, 3) states of the filters that never felt an error."""
        return np.zeros((N_CUES, _ORDER))

    def advance(self, state: Floats, before: Floats, now: Floats) -> Floats:
        """(6, 3) states one time step later.

        Args:
            state: (6, 3) before.
            before: (6,) error before, SI.
            now: (6,) error now.
        """
        if self.response is None:
            return state
        pairs = np.stack([before, now], axis=1) / cue_scales()[:, None]
        return np.array(
            [
                r.a @ x + r.begin * u[0] + r.end * u[1]
                for r, x, u in zip(self._steps, state, pairs, strict=True)
            ]
        )

    def memory(self, state: Floats, error: Floats) -> Floats | None:
        """(n, 6) sensed errors at the nodes, in zones, were the error to be 0 from there on; None for "cab".

        Args:
            state: (6, 3) of the filters now.
            error: (6,) now, SI.
        """
        if self.response is None:
            return None
        begin = np.append(state, (error / cue_scales())[:, None], axis=1)
        return np.asarray(np.einsum("cni,ci->nc", self._memory, begin))


def _system(model: VestibularModel, cue: int) -> tuple[Floats, Floats, Floats, float]:
    transfer = model.otoliths.transfer_function() if cue < 3 else model.canals.transfer_function(cue - 3)
    a, b, c, d = tf2ss(*transfer)
    k = a.shape[0]
    whole, gain, out = np.zeros((_ORDER, _ORDER)), np.zeros(_ORDER), np.zeros(_ORDER)
    whole[:k, :k], gain[:k], out[:k] = a, b[:, 0], c[0]
    return whole, gain, out, float(d[0, 0])


def _ramp(system: tuple[Floats, Floats, Floats, float], h: float) -> Ramp:
    """A system over an interval of ``h`` seconds."""
    a, b, c, d = system
    augmented = np.zeros((_ORDER + 2, _ORDER + 2))
    augmented[:_ORDER, :_ORDER], augmented[:_ORDER, _ORDER] = a * h, b * h
    augmented[_ORDER, _ORDER + 1] = 1.0
    whole = expm(augmented)
    constant, slope = whole[:_ORDER, _ORDER], whole[:_ORDER, _ORDER + 1]
    return Ramp(whole[:_ORDER, :_ORDER], constant - slope, slope, c, d)


def _over(system: tuple[Floats, Floats, Floats, float], steps: Floats) -> tuple[Floats, Floats]:
    """Response (n, n) to values at the nodes, and (n, 4) to the state and the value now."""
    n = len(steps)
    state = np.hstack([np.eye(_ORDER), np.zeros((_ORDER, n + 1))])  # by state, value now, values at nodes
    out = np.zeros((n, _ORDER + 1 + n))
    for j, h in enumerate(steps):
        ramp = _ramp(system, float(h))
        state = ramp.a @ state
        state[:, _ORDER + j] += ramp.begin
        state[:, _ORDER + j + 1] += ramp.end
        out[j] = ramp.c @ state
        out[j, _ORDER + 1 + j] += ramp.d
    return out[:, _ORDER + 1 :], out[:, : _ORDER + 1]
