"""The filter blocks of the washout, as states and accelerations, discretised by the trapezoidal rule.

A high-pass before a double integrator is one oscillator: its acceleration is the filter's output and its
position the integral, so the zeros at s = 0 (z = 1) cancel the integrators exactly and nothing drifts.
Within a step the acceleration is constant, as in the machine.
"""

from __future__ import annotations

import warp as wp

from ...envs.precision import real, vec2


@wp.struct
class HighPassParameters:
    """See :class:`~.parameters.HighPass`."""

    order: int
    frequency: real
    damping: real


@wp.func
def high_pass(p: HighPassParameters, x: real, v: real, u: real, dt: real) -> real:
    """Output of HPS, HPI or HPR: the acceleration of the oscillator (x, v) driven by u."""
    w = p.frequency
    if p.order == 2:
        pull = real(2.0) * p.damping * w * v + w * w * (x + real(0.5) * dt * v)
        return (u - pull) / (real(1.0) + p.damping * w * dt + real(0.25) * w * w * dt * dt)
    if p.order == 1:
        return (u - w * v) / (real(1.0) + real(0.5) * w * dt)
    return u


@wp.func
def low_pass(frequency: real, damping: real, x: real, v: real, u: real, dt: real) -> real:
    """Second derivative of the output x of LP or LPC: w^2 / (s^2 + 2 zeta w s + w^2) u."""
    w = frequency
    push = w * w * (u - x - real(0.5) * dt * v) - real(2.0) * damping * w * v
    return push / (real(1.0) + damping * w * dt + real(0.25) * w * w * dt * dt)


@wp.func
def moved(x: real, v: real, acceleration: real, dt: real) -> vec2:
    """Position and velocity after a step of constant acceleration."""
    return vec2(x + dt * v + real(0.5) * dt * dt * acceleration, v + dt * acceleration)
