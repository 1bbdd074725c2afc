"""The limits of a machine at a node, as inequalities lower <= h(q, v, a) <= upper.

With the extension l of an actuator, its limits of speed V and acceleration A, and the spacing T of the nodes:

    l + ldot^2 / (2 A) <= l_max,    l - ldot^2 / (2 A) >= l_min,
    |ldot + lddot T / 4| <= V,      |ldot - lddot T / 4| <= V,      |lddot| <= A.

The first line holds for a motion within its limits exactly if it can always be stopped in time. In the second
one T / 4 is for the way between nodes: where lddot is a straight line that crosses zero, ldot peaks there.
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
    machine: SymbolicMachine,
    q: Expression,
    v: Expression,
    a: Expression,
    spacing: float,
    margin: float,
    widened: float | None = None,
) -> NodeLimits:
    """The inequalities of a node; the last six are those of leg accelerations.

    Args:
        machine: The machine.
        q: (9,) positions.
        v: (9,) rates.
        a: (9,) accelerations.
        spacing: From one node to the next, s.
        margin: Share of the limits of speed and acceleration that is kept free.
        widened: The same where it is wider than what was counted on for braking; default: ``margin``.
    """
    legs, limits = machine.leg_motion(q, v, a), machine.limits
    extension, rate, acceleration = (
        cs.vertcat(axes[:2], part, axes[TURNTABLE]) for axes, part in zip((q, v, a), legs, strict=True)
    )
    used = 1.0 - (margin if widened is None else widened)
    there = np.flatnonzero(_present(limits))
    stopping = _stopping(extension, rate, limits, spacing, 1.0 - margin)
    speed, force = limits["velocity"][there] * used, limits["acceleration"][LEGS] * used
    peak = acceleration[there.tolist()] * spacing / 4.0
    rates = rate[there.tolist()]
    return NodeLimits(
        cs.vertcat(stopping.value, rates + peak, rates - peak, legs.acceleration),
        np.concatenate([stopping.lower, -speed, -speed, -force]),
        np.concatenate([stopping.upper, speed, speed, force]),
    )


def _stopping(
    extension: Expression, rate: Expression, limits: dict[str, Floats], spacing: float, used: float
) -> NodeLimits:
    """Every actuator with travel can stop before its ends."""
    with_travel = np.flatnonzero(np.isfinite(limits["position_max"]) & _present(limits))
    rows, most = with_travel.tolist(), limits["acceleration"][with_travel] * used
    # Between nodes an actuator that stops there goes at most A spacing^2 / 8 further.
    free = most * spacing**2 / 8.0
    way = rate[rows] ** 2 / (2.0 * cs.DM(most))
    unbounded = np.full(len(rows), np.inf)
    return NodeLimits(
        cs.vertcat(extension[rows] + way, extension[rows] - way),
        np.concatenate([-unbounded, limits["position_min"][with_travel] + free]),
        np.concatenate([limits["position_max"][with_travel] - free, unbounded]),
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
