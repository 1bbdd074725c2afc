"""The limits of a machine at a node, as inequalities lower <= h(q, v, a) <= upper.

With the extension l of an actuator, its limits of speed V and acceleration A, and the spacing T of the nodes:

    l + ldot^2 / (2 A) <= l_max,    l - ldot^2 / (2 A) >= l_min,
    |ldot + lddot T / 4| <= V,      |ldot - lddot T / 4| <= V,      |lddot| <= A,

and where it is asked for, with the clearance c of a pose (det J over its value at neutral),

    c(q) >= c_min,    c(q + v tau / 2) >= c_min,    tau = |ldot|_2 / A.

The first line holds for a motion within its limits exactly if it can always be stopped in time. In the second
one T / 4 is for the way between nodes: where lddot is a straight line that crosses zero, ldot peaks there.
The last line keeps the platform from singular poses: tau is no shorter than the legs take to brake, v tau / 2
no shorter than the way there.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from ...envs.platform.singularity import NEARLY_SINGULAR
from ...envs.platform.state import LEGS, TURNTABLE
from ...envs.simulator import N_AXES
from ..symbolic import SymbolicMachine
from ..symbolic.library import Expression, cs

Floats = NDArray[np.float64]

_SPARE_CLEARANCE: Final = 0.03
"""On top of what the machine insists on, for the way between nodes."""

_NO_RATE: Final = 1e-3
"""Below it the way of braking legs is taken as none, m/s: keeps a square root smooth."""


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
    clear: bool = False,
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
        clear: Whether to keep away from singular poses. Most motions come nowhere near one.
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
    poses = _clearances(machine, q, v, legs.rate) if clear else cs.SX(0, 1)
    least = np.full(poses.numel(), float(NEARLY_SINGULAR) + _SPARE_CLEARANCE)
    return NodeLimits(
        cs.vertcat(stopping.value, rates + peak, rates - peak, poses, legs.acceleration),
        np.concatenate([stopping.lower, -speed, -speed, least, -force]),
        np.concatenate([stopping.upper, speed, speed, np.full(len(least), np.inf), force]),
    )


def _clearances(machine: SymbolicMachine, q: Expression, v: Expression, leg_rates: Expression) -> Expression:
    """(2,) of a pose, and of one no nearer than where the platform comes to rest if the legs brake."""
    slowest = float(machine.limits["acceleration"][LEGS].min())
    time = cs.sqrt(cs.sumsqr(leg_rates) + _NO_RATE**2) / slowest
    return cs.vertcat(*(machine.clearance(pose) for pose in (q, q + 0.5 * time * v)))


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
