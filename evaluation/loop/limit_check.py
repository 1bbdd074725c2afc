"""Whether set-points keep a machine's limits: position, velocity and acceleration of every actuator."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ...envs.platform import ACTUATORS, Platform, actuator_limits
from .packets import SetPoint

Floats = NDArray[np.float64]

_TOLERANCE = 1e-6
"""Of each limit, relative; of a travel, of the whole stroke."""
_UNLIMITED = 1e3
"""Stroke that is taken for the tolerance where there is none, rad."""


class LimitCheck:
    """Holds each set-point, and what lies between two, against the limits.

    Args:
        platform: The machine.
        rate: Set-points a second.
    """

    def __init__(self, platform: Platform, rate: int) -> None:
        limits = actuator_limits(platform)
        slack = _TOLERANCE * np.minimum(limits["position_max"] - limits["position_min"], _UNLIMITED)
        self._low, self._high = limits["position_min"] - slack, limits["position_max"] + slack
        self._velocity = limits["velocity"] * (1.0 + _TOLERANCE)
        self._acceleration = limits["acceleration"] * (1.0 + _TOLERANCE)
        self._rate = rate
        self._before: tuple[int, Floats] | None = None

    def __call__(self, setpoint: SetPoint) -> str:
        """What is wrong with a set-point, in words; nothing if nothing is."""
        position = _actuators(setpoint.part("position"), setpoint.part("legs"))
        velocity = _actuators(setpoint.part("velocity"), setpoint.part("leg_rates"))
        if not np.isfinite(setpoint.motion).all():
            return f"set-point {setpoint.sequence} is not finite"
        wrong = self._wrong("position", (position < self._low) | (position > self._high))
        wrong = wrong or self._wrong("velocity", np.abs(velocity) > self._velocity)
        if self._before is not None and setpoint.sequence > self._before[0]:
            change = (velocity - self._before[1]) * self._rate / (setpoint.sequence - self._before[0])
            wrong = wrong or self._wrong("acceleration", np.abs(change) > self._acceleration)
        self._before = setpoint.sequence, velocity
        return f"set-point {setpoint.sequence} exceeds the {wrong}" if wrong else ""

    def _wrong(self, what: str, beyond: NDArray[np.bool_]) -> str:
        return f"{what} limit of {ACTUATORS[int(np.argmax(beyond))]}" if beyond.any() else ""


def _actuators(axes: Floats, legs: Floats) -> Floats:
    """(9,) values of the actuators, of those of axes and legs."""
    return np.concatenate([axes[:2], legs, axes[8:]])
