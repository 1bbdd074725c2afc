"""Braking to a stop: what a controller does without a plan."""

from __future__ import annotations

import numpy as np

from ...envs.platform import Platform
from ...envs.simulator import N_AXES, TIME_STEP
from ..symbolic import SymbolicMachine
from ..symbolic.library import cs
from .linearisation import Floats
from .problem import moving_axes


class Brakes:
    """Accelerations that bring every actuator to rest by itself, as fast as its acceleration limit lets it.

    So each leg stops where its own limits say it can; the platform's pose follows from the legs.
    """

    def __init__(self, platform: Platform) -> None:
        machine = SymbolicMachine(platform)
        q, v, a = (cs.SX.sym(name, N_AXES) for name in ("q", "v", "a"))
        legs = machine.leg_motion(q, v, a)
        slope = cs.jacobian(legs.acceleration, a[2:8])
        drift = cs.substitute(legs.acceleration, a, cs.SX.zeros(N_AXES))
        self._legs = cs.Function("legs", [q, v], [legs.rate, slope, drift])
        self._limit = machine.limits["acceleration"]
        self._moving = np.isin(np.arange(N_AXES), moving_axes(platform))

    def __call__(self, position: Floats, rate: Floats) -> Floats:
        """(9,) accelerations for the next time step.

        Args:
            position: (9,) of the axes.
            rate: (9,).
        """
        legs, slope, drift = (np.asarray(part) for part in self._legs(position, rate))
        actuators = np.concatenate([rate[:2], legs[:, 0], rate[8:]])
        stop = -np.clip(actuators / TIME_STEP, -self._limit, self._limit)
        stop[2:8] = np.linalg.solve(slope, stop[2:8] - drift[:, 0])
        return np.asarray(np.where(self._moving, stop, 0.0))
