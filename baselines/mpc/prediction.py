"""Accelerations that are straight lines between nodes: the motion they give, exactly.

On an interval of length h from a_0 to a_1 a double integrator goes to

    v_1 = v_0 + h (a_0 + a_1) / 2,    q_1 = q_0 + h v_0 + h^2 (2 a_0 + a_1) / 6,

and before the first node the acceleration is constant. All nine axes share these maps.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import expm
from scipy.signal import lfilter, tf2ss

from ...envs.cues import GRAVITY, CueTrace
from ...envs.perception import get_vestibular_model
from ...envs.perception.models import VestibularModel
from ...envs.platform import Platform
from ...envs.simulator.kernels.step import CueCost
from ...envs.simulator.simulator import N_AXES, TIME_STEP
from ..symbolic import Expression, SymbolicMachine, compiled, cs
from .parameters import Forecast, Margins, MpcParameters

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Grid:
    """Nodes and what they make of accelerations; n nodes.

    Args:
        times: (n,) from now, s.
        position: (n, n) from accelerations at the nodes to positions there.
        rate: (n, n) to rates.
        weights: (n,) of each node in a mean over the horizon, by the trapezoidal rule; their sum is 1.
    """

    times: Floats
    position: Floats
    rate: Floats
    weights: Floats

    def motion(self, position: Floats, rate: Floats, accelerations: Floats) -> tuple[Floats, Floats]:
        """Positions and rates at the nodes, (n, k) each.

        Args:
            position: (k,) now, m or rad.
            rate: (k,) now.
            accelerations: (n, k) at the nodes.
        """
        free = position + np.outer(self.times, rate)
        return free + self.position @ accelerations, rate + self.rate @ accelerations

    def at(self, accelerations: Floats, times: Floats) -> Floats:
        """Accelerations (m, k) of a plan at other times; constant before the first and after the last node.

        Args:
            accelerations: (n, k) at the nodes.
            times: (m,) from now, s.
        """
        j = np.clip(np.searchsorted(self.times, times) - 1, 0, len(self.times) - 2)
        begin, end = self.times[j], self.times[j + 1]
        share = np.clip((times - begin) / (end - begin), 0.0, 1.0)[:, None]
        return np.asarray((1.0 - share) * accelerations[j] + share * accelerations[j + 1])

    def averages(self, dt: float) -> Floats:
        """(n, m) from samples at dt, 2 dt ... to the horizon to one value a node.

        Each node takes the mean under its hat, the line that is 1 there and 0 at its neighbors, so that
        nothing between two nodes is overlooked. The first takes the sample at its own time.
        """
        count = max(round(self.times[-1] / dt), 1)
        samples = dt * np.arange(1, count + 1)
        unit: Any = np.eye(len(self.times))
        hats = np.array([np.interp(samples, self.times, row) for row in unit])
        hats[:, samples < self.times[0]] = 0.0
        hats[0] = 0.0
        hats[0, min(max(round(self.times[0] / dt), 1), count) - 1] = 1.0
        return np.asarray(hats / np.maximum(hats.sum(axis=1, keepdims=True), np.finfo(float).tiny))


def make_grid(nodes: tuple[float, ...]) -> Grid:
    """The grid of nodes at times from now, s."""
    times = np.array(nodes)
    n = len(times)
    position, rate = np.zeros((n, n)), np.zeros((n, n))
    rate[0, 0], position[0, 0] = times[0], 0.5 * times[0] ** 2
    for j, h in enumerate(np.diff(times)):
        rate[j + 1] = rate[j]
        rate[j + 1, j : j + 2] += 0.5 * h
        position[j + 1] = position[j] + h * rate[j]
        position[j + 1, j : j + 2] += h**2 * np.array([2.0, 1.0]) / 6.0
    steps = np.diff(times, prepend=0.0)
    weights = np.append(steps[:-1] + steps[1:], steps[-1])
    weights[0] += steps[0]
    return Grid(times, position, rate, weights / weights.sum())


# The machine about a plan, to first order: cues, and how near every actuator is to its limits.
#
# One CasADi function gives, for every node at once, values and derivatives of
#
# - the cues f_SS and omega_SS in zones of J;
# - for each actuator at q with rate v the place where it could stop, q + v|v| / (2 A), its rate and its
#   acceleration, as shares of their ranges. That the place lies within the travel is the constraint
#   v^2 + 2 (q_max - q) a_min <= 0 for both ends, and without one it is a position limit at rest.


N_CUES: Final = 6


@dataclass(frozen=True)
class Linearization:
    """Values and derivatives at n nodes, k rows each: the cues, then the limits.

    Args:
        values: (n, k).
        slopes: (n, k, 27) by positions, rates and accelerations of the nine axes.
    """

    values: Floats
    slopes: Floats

    def ahead(self, moved: Floats) -> Floats:
        """(n, k) values after a small change (n, 27) of positions, rates and accelerations."""
        return np.asarray(self.values + (self.slopes @ moved[:, :, None])[:, :, 0])


class Linearized:
    """The function for a machine and a number of nodes; its results are overwritten by the next call.

    Args:
        platform: The machine.
        nodes: Their number, n.
        margins: Shares of the limits.
        compile: Whether to compile the function where that can be done.

    Attributes:
        lower: (k - 6,) least values of the limit rows.
        upper: (k - 6,) greatest.
    """

    def __init__(self, platform: Platform, nodes: int, margins: Margins, compile: bool = True) -> None:
        machine = SymbolicMachine(platform)
        q, v, a = (cs.SX.sym(name, N_AXES) for name in ("q", "v", "a"))
        limits, self.lower, self.upper = _limit_rows(machine, margins, q, v, a)
        rows = cs.vertcat(_cue_rows(machine, q, v, a), limits)
        slopes = cs.jacobian(rows, cs.vertcat(q, v, a))
        outputs = [rows, cs.densify(cs.vec(slopes.T))]
        node = cs.Function("linearized", [q, v, a], outputs).map(nodes)
        self._function: Any = compiled(node) if compile else node
        self._inputs = [np.zeros((nodes, N_AXES)) for _ in range(3)]
        self._result = Linearization(np.zeros((nodes, rows.numel())), np.zeros((nodes, *slopes.shape)))
        self._buffer, self._evaluate = self._function.buffer()
        for i, array in enumerate(self._inputs):
            self._buffer.set_arg(i, array.data)
        self._buffer.set_res(0, self._result.values.data)
        self._buffer.set_res(1, self._result.slopes.data)

    def __call__(self, position: Floats, rate: Floats, acceleration: Floats) -> Linearization:
        """The machine about positions, rates and accelerations (n, 9) at the nodes."""
        for array, values in zip(self._inputs, (position, rate, acceleration), strict=True):
            array[...] = values
        self._evaluate()
        return self._result


def _cue_rows(machine: SymbolicMachine, q: Expression, v: Expression, a: Expression) -> Expression:
    """(6,) cues in zones."""
    zone = CueCost()
    force, rate = machine.cues(q, v, a)
    return cs.vertcat(force / zone.force, rate / zone.rate)


def cue_scales() -> Floats:
    """(6,) what one unit of the cue rows is, m/s^2 and rad/s."""
    zone = CueCost()
    return np.repeat([zone.force, zone.rate], 3)


def _limit_rows(
    machine: SymbolicMachine, margins: Margins, q: Expression, v: Expression, a: Expression
) -> tuple[Expression, Floats, Floats]:
    """Stopping places, rates and accelerations of the actuators there are, with their bounds."""
    limits, legs = machine.limits, machine.leg_motion(q, v, a)
    place = cs.vertcat(q[:2], legs.extension, q[8])
    rate = cs.vertcat(v[:2], legs.rate, v[8])
    acceleration = cs.vertcat(a[:2], legs.acceleration, a[8])
    stop = place + rate * cs.fabs(rate) / (2.0 * margins.braking * limits["acceleration"])
    low, high = limits["position_min"], limits["position_max"]
    present = np.flatnonzero(high > low)
    ending = present[np.isfinite(high - low)[present]]
    span = 0.5 * (high - low)[ending]
    rows = (
        (stop[ending.tolist()] / span, margins.position * low[ending] / span),
        (rate[present.tolist()] / limits["velocity"][present], np.full(len(present), -margins.rate)),
        (
            acceleration[present.tolist()] / limits["acceleration"][present],
            np.full(len(present), -margins.acceleration),
        ),
    )
    lower = np.concatenate([bounds for _, bounds in rows])
    upper = np.concatenate([margins.position * high[ending] / span, -rows[1][1], -rows[2][1]])
    return cs.vertcat(*(row for row, _ in rows)), lower, upper


# The car's cues over the horizon: known, or guessed.


REST: Final = np.array([0.0, 0.0, -GRAVITY, 0.0, 0.0, 0.0])
"""Specific force and angular velocity at rest on level ground."""


class Forecaster:
    """Gives the cues at the nodes of a grid.

    What is not known goes on from the last that is, in two parts: what lasts, the low-pass m of the cues
    u so far, and what is new,

        u(t) = rest + (m_0 - rest) exp(-t / lasting) + (u_0 - m_0) exp(-t / decay).

    Args:
        grid: The nodes.
        forecast: What is known.
        cues: The drive, where some of it is known.
    """

    def __init__(self, grid: Grid, forecast: Forecast, cues: CueTrace | None = None) -> None:
        averages = grid.averages(TIME_STEP)
        count = averages.shape[1]
        known = min(round(forecast.preview / TIME_STEP), count) if cues is not None else 0
        self._gain = 1.0 - np.exp(-TIME_STEP / forecast.memory)
        self._known, self._guessed = averages[:, :known], averages[:, known:]
        after = TIME_STEP * np.arange(1, count - known + 1)[:, None]
        constants = np.array([*forecast.force_decay, *[forecast.rate_decay] * 3])
        self._new = self._guessed @ np.exp(-after / constants)  # (n, 6)
        self._lasting = self._guessed @ np.exp(-after / forecast.lasting_decay)  # (n, 1)
        self._level = self._guessed.sum(axis=1, keepdims=True)
        if cues is not None:
            self._drive = _padded(cues, known)
            self._lasts = lfilter(
                [self._gain],
                [1.0, self._gain - 1.0],
                self._drive,
                axis=0,
                zi=(1.0 - self._gain) * self._drive[:1],
            )[0]

    def remember(self, lasts: Floats | None, now: Floats) -> Floats:
        """(6,) what lasts, from what lasted a time step ago (None at the start) and the cues now."""
        return now if lasts is None else lasts + self._gain * (now - lasts)

    def __call__(self, now: Floats, lasts: Floats, sample: int) -> Floats:
        """(n, 6) cues at the nodes, SI.

        Args:
            now: (6,) cues at this sample.
            lasts: (6,) what of them lasts.
            sample: Its number in the drive.
        """
        count = self._known.shape[1]
        if count == 0:
            return self._guess(now, lasts)
        last = min(sample, len(self._drive) - count - 1) + count
        ahead = self._drive[last + 1 - count : last + 1]
        return np.asarray(self._known @ ahead + self._guess(ahead[-1], self._lasts[last]))

    def _guess(self, now: Floats, lasts: Floats) -> Floats:
        return np.asarray(self._level * REST + self._lasting * (lasts - REST) + self._new * (now - lasts))


def _padded(cues: CueTrace, count: int) -> Floats:
    """The cues of a drive (samples + count, 6), its last held after its end."""
    drive = np.hstack([cues.specific_force, cues.angular_velocity])
    return np.concatenate([drive, np.repeat(drive[-1:], count, axis=0)])


# The perceived error over the horizon: what a vestibular model makes of the error of the cues.
#
# Canals and otoliths are linear, so what is sensed of an error is the error filtered. For an error that is
# a straight line between nodes, the filter's response at the nodes is a matrix, and the memory of what was
# felt before another.


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
