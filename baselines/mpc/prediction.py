r"""Prediction model: motion, cues and limits, reference cue and perceived error at the nodes of the horizon.

**Motion.** Every axis is a double integrator, and its acceleration is a straight line between nodes. On an
interval of length h from a_0 to a_1 it goes exactly to

    v_1 = v_0 + h (a_0 + a_1) / 2,    q_1 = q_0 + h v_0 + h^2 (2 a_0 + a_1) / 6.

Before the first node the acceleration is constant. So positions and rates at the nodes are linear in the
accelerations there, q = q_0 + t v_0 + Q a and v = v_0 + V a, and all nine axes share Q and V (:class:`Grid`).

**Cues and limits.** One CasADi function gives values and derivatives of all rows at all nodes
(:class:`MachineModel`): the cues f_SS and omega_SS in indifference zones, and for each actuator at q with
rate v its stopping place, its rate and its acceleration, as shares of their ranges. The stopping place is

    q + v |v| / (2 A).

It lies within the travel exactly if the actuator can brake in time: v^2 + 2 (q_max - q) a_min <= 0.

**Reference cue.** Known for the preview. Beyond it the cue u is extrapolated in two parts, the sustained one
m (a low-pass of u) and the transient one u - m (:class:`Forecaster`):

    u(t) = rest + (m_0 - rest) exp(-t / lasting) + (u_0 - m_0) exp(-t / decay).

**Perceived error.** Canals and otoliths are linear, so the perceived error is the error filtered. For an
error that is a straight line between nodes, both the response at the nodes and the effect of the filters'
states are matrices (:class:`PerceivedError`).
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
    """The n nodes of the horizon and their integration matrices.

    Args:
        times: (n,) from now, s.
        position: (n, n) Q, from accelerations at the nodes to positions there.
        rate: (n, n) V, to rates there.
        weights: (n,) weight of each node in a mean over the horizon, by the trapezoidal rule; their sum is 1.
    """

    times: Floats
    position: Floats
    rate: Floats
    weights: Floats

    def motion(self, position: Floats, rate: Floats, accelerations: Floats) -> tuple[Floats, Floats]:
        """Positions and rates (n, k) at the nodes, from those now (k,) and accelerations (n, k)."""
        free = position + np.outer(self.times, rate)
        return free + self.position @ accelerations, rate + self.rate @ accelerations

    def at(self, accelerations: Floats, times: Floats) -> Floats:
        """(m, k) of accelerations (n, k) at times (m,), s; constant before and after the nodes."""
        j = np.clip(np.searchsorted(self.times, times) - 1, 0, len(self.times) - 2)
        begin, end = self.times[j], self.times[j + 1]
        share = np.clip((times - begin) / (end - begin), 0.0, 1.0)[:, None]
        return np.asarray((1.0 - share) * accelerations[j] + share * accelerations[j + 1])

    def averages(self, dt: float) -> Floats:
        """(n, m) matrix from samples at dt, 2 dt ... to the horizon to one value a node.

        Each node takes the mean under its hat function, which is 1 there and 0 at its neighbors. So no
        sample between two nodes is lost. The first node takes the sample at its own time.
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


N_CUES: Final = 6


@dataclass(frozen=True)
class Linearization:
    """Values and first derivatives of k rows at n nodes: the cues, then the limits.

    Args:
        values: (n, k).
        slopes: (n, k, 27) by positions, rates and accelerations of the nine axes.
    """

    values: Floats
    slopes: Floats

    def at(self, change: Floats) -> Floats:
        """(n, k) values, to first order, after a change (n, 27) of positions, rates and accelerations."""
        return np.asarray(self.values + (self.slopes @ change[:, :, None])[:, :, 0])


class MachineModel:
    """Linearization of cues and limits at n nodes; its results are overwritten by the next call.

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
        force, rate = machine.cues(q, v, a)
        rows = cs.vertcat(force / CueCost().force, rate / CueCost().rate, limits)
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


def cue_scales() -> Floats:
    """(6,) indifference zones of J, the units of the cue rows, m/s^2 and rad/s."""
    return np.repeat([CueCost().force, CueCost().rate], 3)


def _limit_rows(
    machine: SymbolicMachine, margins: Margins, q: Expression, v: Expression, a: Expression
) -> tuple[Expression, Floats, Floats]:
    """Stopping places, rates and accelerations of the machine's actuators, with their bounds."""
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


REST: Final = np.array([0.0, 0.0, -GRAVITY, 0.0, 0.0, 0.0])
"""Specific force and angular velocity at rest on level ground."""


class Forecaster:
    """Forecast of the reference cue at the nodes of a grid.

    Args:
        grid: The nodes.
        forecast: Preview and time constants.
        cues: The drive, where some of it is known.
    """

    def __init__(self, grid: Grid, forecast: Forecast, cues: CueTrace | None = None) -> None:
        averages = grid.averages(TIME_STEP)
        count = averages.shape[1]
        known = min(round(forecast.preview / TIME_STEP), count) if cues is not None else 0
        self._gain = 1.0 - np.exp(-TIME_STEP / forecast.memory)
        self._known, beyond = averages[:, :known], averages[:, known:]
        times = TIME_STEP * np.arange(1, count - known + 1)[:, None]
        decays = np.array([*forecast.force_decay, *[forecast.rate_decay] * 3])
        self._transient = beyond @ np.exp(-times / decays)  # (n, 6)
        self._sustained = beyond @ np.exp(-times / forecast.lasting_decay)  # (n, 1)
        self._rest = beyond.sum(axis=1, keepdims=True)  # (n, 1)
        if cues is not None:
            # After its end a drive holds its last cue.
            drive = np.hstack([cues.specific_force, cues.angular_velocity])
            self._expected = cues.expected
            self._ahead = TIME_STEP * np.arange(1, known + 1)
            self._drive = np.concatenate([drive, np.repeat(drive[-1:], known, axis=0)])
            self._drive_sustained = lfilter(
                [self._gain],
                [1.0, self._gain - 1.0],
                self._drive,
                axis=0,
                zi=(1.0 - self._gain) * self._drive[:1],
            )[0]

    def update(self, sustained: Floats | None, now: Floats) -> Floats:
        """(6,) sustained cue, from that of a time step ago (None at the start) and the cue now."""
        return now if sustained is None else sustained + self._gain * (now - sustained)

    def __call__(self, now: Floats, sustained: Floats, sample: int) -> Floats:
        """(n, 6) reference cue at the nodes, SI.

        Args:
            now: (6,) cue at this sample.
            sustained: (6,) its sustained part.
            sample: Number of the sample in the drive.
        """
        count = self._known.shape[1]
        if count == 0:
            return self._extrapolated(now, sustained)
        if self._expected is not None:
            here = slice(min(sample, len(self._expected) - 1), min(sample, len(self._expected) - 1) + 1)
            preview = self._expected.at(now[None, :], self._ahead, here)[0]
            for cue in preview:
                sustained = self.update(sustained, cue)
            return np.asarray(self._known @ preview + self._extrapolated(preview[-1], sustained))
        last = min(sample, len(self._drive) - count - 1) + count
        preview = self._drive[last + 1 - count : last + 1]
        return np.asarray(
            self._known @ preview + self._extrapolated(preview[-1], self._drive_sustained[last])
        )

    def _extrapolated(self, now: Floats, sustained: Floats) -> Floats:
        decaying = self._sustained * (sustained - REST)
        return np.asarray(self._rest * REST + decaying + self._transient * (now - sustained))


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


class PerceivedError:
    """Vestibular filters of the six cues' errors.

    Args:
        grid: The nodes.
        parameters: With the objective; for "cab" there is nothing to filter.

    Attributes:
        response: (6, n, n) from errors at the nodes to perceived errors there; None for "cab".
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
        self._free_response = np.array([free for _, free in over_nodes])
        self._steps = [_ramp(system, TIME_STEP) for system in systems]

    def start(self) -> Floats:
        """(6, 3) states of the filters before any error."""
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

    def free_response(self, state: Floats, error: Floats) -> Floats | None:
        """(n, 6) perceived errors at the nodes, in zones, for an error of 0 at all of them; None for "cab".

        Args:
            state: (6, 3) of the filters now.
            error: (6,) now, SI.
        """
        if self.response is None:
            return None
        begin = np.append(state, (error / cue_scales())[:, None], axis=1)
        return np.asarray(np.einsum("cni,ci->nc", self._free_response, begin))


def _system(model: VestibularModel, cue: int) -> tuple[Floats, Floats, Floats, float]:
    transfer = model.otoliths.transfer_function() if cue < 3 else model.canals.transfer_function(cue - 3)
    a, b, c, d = tf2ss(*transfer)
    k = a.shape[0]
    whole, gain, out = np.zeros((_ORDER, _ORDER)), np.zeros(_ORDER), np.zeros(_ORDER)
    whole[:k, :k], gain[:k], out[:k] = a, b[:, 0], c[0]
    return whole, gain, out, float(d[0, 0])


def _ramp(system: tuple[Floats, Floats, Floats, float], h: float) -> Ramp:
    """A system over an interval of h seconds, by the matrix exponential (van Loan)."""
    a, b, c, d = system
    augmented = np.zeros((_ORDER + 2, _ORDER + 2))
    augmented[:_ORDER, :_ORDER], augmented[:_ORDER, _ORDER] = a * h, b * h
    augmented[_ORDER, _ORDER + 1] = 1.0
    whole = expm(augmented)
    constant, slope = whole[:_ORDER, _ORDER], whole[:_ORDER, _ORDER + 1]
    return Ramp(whole[:_ORDER, :_ORDER], constant - slope, slope, c, d)


def _over(system: tuple[Floats, Floats, Floats, float], steps: Floats) -> tuple[Floats, Floats]:
    """Response (n, n) to errors at the nodes, and free response (n, 4) to the state and the error now."""
    n = len(steps)
    state = np.hstack([np.eye(_ORDER), np.zeros((_ORDER, n + 1))])  # by state, error now, errors at nodes
    out = np.zeros((n, _ORDER + 1 + n))
    for j, h in enumerate(steps):
        ramp = _ramp(system, float(h))
        state = ramp.a @ state
        state[:, _ORDER + j] += ramp.begin
        state[:, _ORDER + j + 1] += ramp.end
        out[j] = ramp.c @ state
        out[j, _ORDER + 1 + j] += ramp.d
    return out[:, _ORDER + 1 :], out[:, : _ORDER + 1]
