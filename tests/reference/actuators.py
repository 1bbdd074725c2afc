"""Actuator dynamics: dead time, then y'' = omega^2 (u - y) - 2 zeta omega y', solved over a step.

Within a step the set-point is u0 + v0 t + a t^2 / 2. One quadratic in t solves the equation for it; what is
left decays as the homogeneous solution, critically or over-damped.
"""

from __future__ import annotations

import numpy as np

from motion_cueing.envs.platform.kernels import ActuatorDynamics

from .frames import Floats


def lag(
    dynamics: ActuatorDynamics,
    y: Floats,
    y_rate: Floats,
    u: Floats,
    u_rate: Floats,
    u_next: Floats,
    dt: float,
) -> tuple[Floats, Floats]:
    """Position and rate after a step in which the set-point's rate goes evenly from u_rate to u_next."""
    omega, zeta = dynamics.natural_frequency, dynamics.damping
    assert omega is not None
    a = (u_next - u_rate) / dt
    offset = u - 2.0 * zeta / omega * u_rate + (4.0 * zeta**2 - 1.0) / omega**2 * a
    slope = u_rate - 2.0 * zeta / omega * a
    decay, decay_rate = homogeneous(omega, zeta, y - offset, y_rate - slope, dt)
    return offset + slope * dt + 0.5 * a * dt**2 + decay, slope + a * dt + decay_rate


def homogeneous(omega: float, zeta: float, y: Floats, v: Floats, t: float) -> tuple[Floats, Floats]:
    """The free motion from (y, v) after ``t``."""
    if zeta == 1.0:
        e = np.exp(-omega * t)
        c = v + omega * y
        return (y + c * t) * e, (v - omega * c * t) * e
    root = omega * np.sqrt(zeta**2 - 1.0)
    fast, slow = -zeta * omega - root, -zeta * omega + root
    c_slow = (v - fast * y) / (slow - fast)
    c_fast = y - c_slow
    e_slow, e_fast = c_slow * np.exp(slow * t), c_fast * np.exp(fast * t)
    return e_slow + e_fast, slow * e_slow + fast * e_fast


def dead_steps(dynamics: ActuatorDynamics, dt: float) -> int:
    """Dead time in whole steps."""
    return round(dynamics.dead_time / dt)
