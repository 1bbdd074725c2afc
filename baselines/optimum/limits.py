"""The limits of a machine at a node, as inequalities lower <= h(q, v, a) <= upper.

For every actuator with travel, with its extension l, rate ldot and limit of acceleration A:

    l + ldot^2 / (2 A) <= l_max,    l - ldot^2 / (2 A) >= l_min,

which holds for a motion within its limits exactly if it can always be stopped in time; and for every leg
|ldot| <= V and |lddot| <= A. Speed and acceleration of carriage and turntable are bounds of the variables.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ...envs.platform.state import LEGS, TURNTABLE
from ...envs.simulator import N_AXES
from ..symbolic import SymbolicMachine
from ..symbolic.library import Expression, cs

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class NodeLimits:
    """Inequalities lower <= value <= upper.

    Args:
        value: (m,) expression.
        lower: (m,), -inf where there is none.
        upper: (m,), inf where there is none.
    """

    value: Expression
    lower: Floats
    upper: Floats


def node_limits(
    machine: SymbolicMachine, q: Expression, v: Expression, a: Expression, spacing: float, margin: float
) -> NodeLimits:
    """The inequalities of a node.

    Args:
        machine: The machine.
        q: (9,) positions.
        v: (9,) rates.
        a: (9,) accelerations.
        spacing: From one node to the next, s: how far an end may be overshot between them is kept free.
        margin: Share of the limits of speed and acceleration that is kept free.
    """
    legs, limits = machine.leg_motion(q, v, a), machine.limits
    extension = cs.vertcat(q[:2], legs.extension, q[TURNTABLE])
    rate = cs.vertcat(v[:2], legs.rate, v[TURNTABLE])
    with_travel = np.flatnonzero(np.isfinite(limits["position_max"]) & _present(limits))
    most = limits["acceleration"][with_travel] * (1.0 - margin)
    rows = with_travel.tolist()
    # Between nodes an actuator that stops there goes at most A spacing^2 / 8 further.
    free = most * spacing**2 / 8.0
    stopping = rate[rows] ** 2 / (2.0 * cs.DM(most))
    unbounded = np.full(len(rows), np.inf)
    speed = limits["velocity"][LEGS] * (1.0 - margin)
    force = limits["acceleration"][LEGS] * (1.0 - margin)
    return NodeLimits(
        cs.vertcat(extension[rows] + stopping, extension[rows] - stopping, legs.rate, legs.acceleration),
        np.concatenate([-unbounded, limits["position_min"][with_travel] + free, -speed, -force]),
        np.concatenate([limits["position_max"][with_travel] - free, unbounded, speed, force]),
    )


def axis_bounds(machine: SymbolicMachine, margin: float) -> tuple[Floats, Floats]:
    """Greatest |v| and |a| of the nine axes, each (9,): 0 where missing, infinite for the hexapod."""
    limits = machine.limits
    axes = [0, 1, TURNTABLE]
    speed, acceleration = np.full(N_AXES, np.inf), np.full(N_AXES, np.inf)
    present = _present(limits)[axes]
    speed[axes] = limits["velocity"][axes] * (1.0 - margin) * present
    acceleration[axes] = limits["acceleration"][axes] * (1.0 - margin) * present
    return speed, acceleration


def _present(limits: dict[str, Floats]) -> NDArray[np.bool_]:
    return np.asarray(limits["position_max"] > limits["position_min"])
