"""The motion from one node to the next, in symbols: where it leads, and the errors on its way.

Accelerations are straight lines between nodes. The machine takes the mean of each of its time steps, which
is the line at the middle of the step, and integrates exactly; so nothing is lost between this plan and the
machine, and the errors are those of every sample.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ...envs.simulator import N_AXES
from ..symbolic import SymbolicMachine
from ..symbolic.library import Expression, cs
from ..symbolic.machine import cues
from .options import OptimumOptions
from .perception import SensedError

N_CUES = 6
"""Specific force and angular velocity."""


@dataclass(frozen=True)
class Interval:
    """Expressions of the interval's symbols.

    Args:
        q: (9,) positions at its first node.
        v: (9,) rates there.
        x: (m,) states of the sensed error there, empty for J.
        a: (9,) accelerations there.
        b: (9,) accelerations at its last node.
        wanted: (7, steps) the car's force and rate at its samples, and 1, or 0 after the end of the drive.
        end: (18 + m,) q, v, x at the last node.
        errors: (6 steps,) errors of all samples in indifference zones.
    """

    q: Expression
    v: Expression
    x: Expression
    a: Expression
    b: Expression
    wanted: Expression
    end: Expression
    errors: Expression


def mean_accelerations(nodes: NDArray[np.float64], steps: int) -> NDArray[np.float64]:
    """Accelerations (n steps, 9) of the machine's time steps, of those at n + 1 nodes (n + 1, 9)."""
    middle = (np.arange(steps) + 0.5) / steps
    lines = nodes[:-1, None] + (nodes[1:] - nodes[:-1])[:, None] * middle[:, None]
    return np.asarray(lines.reshape(-1, N_AXES))


def interval(
    machine: SymbolicMachine, options: OptimumOptions, sensed: SensedError | None, dt: float
) -> Interval:
    """The interval's expressions.

    Args:
        machine: The machine.
        options: Zones, and the number of steps.
        sensed: The filter to put errors through; None to take them as they are.
        dt: Time step of the machine, s.
    """
    q, v, a, b = (cs.SX.sym(name, N_AXES) for name in "qvab")
    x = cs.SX.sym("x", 0 if sensed is None else len(sensed.a))
    wanted = cs.SX.sym("wanted", N_CUES + 1, options.steps)
    cab = machine.platform.cab
    point = cs.DM(cab.reference_point) + (0.0 if options.objective == "J" else cs.DM(cab.head))
    zones = cs.DM([options.force_zone] * 3 + [options.rate_zone] * 3)
    position, rate, memory, errors = q, v, x, []
    for k in range(options.steps):
        mean = a + (b - a) * ((k + 0.5) / options.steps)
        position, rate = position + dt * (rate + 0.5 * dt * mean), rate + dt * mean
        error = (cs.vertcat(*cues(point, position, rate, mean)) - wanted[:N_CUES, k]) / zones
        if sensed is not None:
            felt = error
            error = _sparse(sensed.c) @ memory + cs.DM(sensed.d) * felt
            memory = _sparse(sensed.a) @ memory + _sparse(sensed.b) @ felt
        errors.append(error * wanted[N_CUES, k])
    return Interval(q, v, x, a, b, wanted, cs.vertcat(position, rate, memory), cs.vertcat(*errors))


def _sparse(matrix: NDArray[np.float64]) -> Expression:
    return cs.sparsify(cs.DM(matrix))
