"""Braking to a stop: what a controller does without a plan."""

from __future__ import annotations

from typing import Final

import numpy as np

from ...envs.platform import Platform
from ...envs.simulator import N_AXES, TIME_STEP
from ..symbolic import SymbolicMachine
from ..symbolic.library import cs
from .linearisation import Floats
from .problem import moving_axes

_ROUNDS: Final = 3
"""Newton's steps to the platform's accelerations; each squares the error."""

_LEAST: Final = 1e-3
"""Of the Jacobian's singular values, relative to the largest: directions in which legs move less are left."""

_SHARE: Final = 1.0 - 1e-6
"""Of the acceleration limits, so that rounding does not exceed them."""


class Brakes:
    """Accelerations that bring every actuator to rest by itself, as fast as its acceleration limit lets it.

    So each leg stops where its own limits say it can; the platform's accelerations are those that give
    the legs their rates at the end of the step.
    """

    def __init__(self, platform: Platform) -> None:
        machine = SymbolicMachine(platform)
        q, v, a = (cs.SX.sym(name, N_AXES) for name in ("q", "v", "a"))
        after = machine.leg_rates(q + TIME_STEP * v + 0.5 * TIME_STEP**2 * a, v + TIME_STEP * a)
        self._after = cs.Function("after", [q, v, a], [after, cs.jacobian(after, a[2:8])])
        self._rates = machine.leg_rates
        self._change = _SHARE * TIME_STEP * machine.limits["acceleration"]
        self._moving = np.isin(np.arange(N_AXES), moving_axes(platform))

    def __call__(self, position: Floats, rate: Floats) -> Floats:
        """(9,) accelerations for the next time step.

        Args:
            position: (9,) of the axes.
            rate: (9,).
        """
        legs = np.asarray(self._rates(position, rate))[:, 0]
        actuators = np.concatenate([rate[:2], legs, rate[8:]])
        wanted = actuators - np.clip(actuators, -self._change, self._change)
        action = (wanted - actuators) / TIME_STEP
        action[2:8] = 0.0
        for _ in range(_ROUNDS):
            after, slope = (np.asarray(part) for part in self._after(position, rate, action))
            # Least squares: near a singular pose no accelerations give the legs all of their rates.
            action[2:8] += np.linalg.lstsq(slope, wanted[2:8] - after[:, 0], rcond=_LEAST)[0]
        return np.asarray(np.where(self._moving, action, 0.0))
