"""The machine about a plan, to first order: cues, and how near every actuator is to its limits.

One CasADi function gives, for every node at once, values and derivatives of

- the cues f_SS and omega_SS in zones of J;
- for each actuator at q with rate v the place where it could stop, q + v|v| / (2 A), its rate and its
  acceleration, as shares of their ranges. That the place lies within the travel is the constraint
  v^2 + 2 (q_max - q) a_min <= 0 for both ends, and without one it is a position limit at rest.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from ...envs.cue_cost import CueCost
from ...envs.platform import Platform
from ...envs.simulator import N_AXES
from ..symbolic import SymbolicMachine
from ..symbolic.library import Expression, cs
from .compiled import compiled
from .parameters import Margins

Floats = NDArray[np.float64]

N_CUES: Final = 6


@dataclass(frozen=True)
class Linearisation:
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


class Linearised:
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
        node = cs.Function("linearised", [q, v, a], outputs).map(nodes)
        self._function: Any = compiled(node) if compile else node
        self._inputs = [np.zeros((nodes, N_AXES)) for _ in range(3)]
        self._result = Linearisation(np.zeros((nodes, rows.numel())), np.zeros((nodes, *slopes.shape)))
        self._buffer, self._evaluate = self._function.buffer()
        for i, array in enumerate(self._inputs):
            self._buffer.set_arg(i, array.data)
        self._buffer.set_res(0, self._result.values.data)
        self._buffer.set_res(1, self._result.slopes.data)

    def __call__(self, position: Floats, rate: Floats, acceleration: Floats) -> Linearisation:
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
