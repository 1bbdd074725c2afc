"""Actuator dynamics: a second-order lag and a dead time for each subsystem. None by default, as in the paper.

The lag omega^2 / (s^2 + 2 zeta omega s + omega^2) has zeta >= 1, so its impulse response is nowhere
negative: position, speed and acceleration of the machine are weighted means of those of the set-point,
and keep every limit the set-point keeps. Within a step the set-point moves with constant acceleration;
for that input the lag is discretised exactly.
"""

from __future__ import annotations

from typing import Annotated

import numpy as np
import warp as wp
from numpy.typing import NDArray
from pydantic import Field
from scipy.linalg import expm

from ..precision import real, vec2
from ..settings import NonNegative, Positive, configuration
from .state import Machine


@configuration
class ActuatorDynamics:
    """Second-order lag and dead time of one subsystem.

    Args:
        natural_frequency: omega, rad/s; None for no lag (unity).
        damping: zeta, at least 1 so that no limit is overshot.
        dead_time: Pure delay, s; rounded to whole time steps.
    """

    natural_frequency: Positive | None = None
    damping: Annotated[float, Field(ge=1.0)] = 1.0
    dead_time: NonNegative = 0.0


def lag_transition(dynamics: ActuatorDynamics, dt: float) -> NDArray[np.float64]:
    """(2, 5) matrix from [y, ydot, u, udot, uddot] to [y, ydot] one step later, u being the set-point.

    Zero where there is no lag; such a subsystem is not filtered.
    """
    omega = dynamics.natural_frequency
    if omega is None:
        return np.zeros((2, 5))
    system = np.zeros((5, 5))
    system[0, 1] = 1.0
    system[1, :3] = [-(omega**2), -2.0 * dynamics.damping * omega, omega**2]
    system[2, 3] = system[3, 4] = 1.0
    return np.asarray(expm(system * dt)[:2])


@wp.func
def subsystem(actuator: int) -> int:
    """0 carriage, 1 hexapod, 2 turntable."""
    if actuator < 2:
        return 0
    if actuator < 8:
        return 1
    return 2


@wp.func
def lag(
    m: Machine, actuator: int, y: real, y_rate: real, u: real, u_rate: real, u_next: real, dt: real
) -> vec2:
    """Position and rate of a lagging actuator after a step; its set-point's rate goes to ``u_next``."""
    row = 2 * subsystem(actuator)
    u_acceleration = (u_next - u_rate) / dt
    position = (
        m.lag[row, 0] * y
        + m.lag[row, 1] * y_rate
        + m.lag[row, 2] * u
        + m.lag[row, 3] * u_rate
        + m.lag[row, 4] * u_acceleration
    )
    rate = (
        m.lag[row + 1, 0] * y
        + m.lag[row + 1, 1] * y_rate
        + m.lag[row + 1, 2] * u
        + m.lag[row + 1, 3] * u_rate
        + m.lag[row + 1, 4] * u_acceleration
    )
    return vec2(position, rate)
