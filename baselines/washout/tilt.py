"""Tilt coordination: Eqs. (18) to (21), with rate and acceleration limits that do not overshoot."""

from __future__ import annotations

import warp as wp

from ...envs.cues import GRAVITY
from ...envs.precision import real, vec2

BRAKING_SHARE = wp.constant(real(0.8))
"""Share of the acceleration limit the approach counts on: braking in whole steps must not overshoot."""


@wp.func
def tilt_angles(force: vec2, psi: real) -> vec2:
    """Eqs. (19), (21): [phi, theta] = N fL for a yaw angle psi_S."""
    g = real(wp.static(GRAVITY))
    s = wp.sin(psi)
    c = wp.cos(psi)
    return vec2((-s * force[0] - c * force[1]) / g, (c * force[0] - s * force[1]) / g)


@wp.func
def tilt_angle_rates(force: vec2, force_rate: vec2, psi: real, psi_rate: real) -> vec2:
    """Eq. (52): the time derivative of N fL."""
    turned = tilt_angles(force, psi + real(wp.static(1.5707963267948966)))
    return tilt_angles(force_rate, psi) + turned * psi_rate


@wp.func
def approach_speed(error: real, gain: real, acceleration: real) -> real:
    """Speed at which to close in on a target: a straight line near it, a braking parabola farther off."""
    corner = acceleration / (gain * gain)
    distance = wp.abs(error)
    if distance <= corner:
        return gain * error
    return wp.sign(error) * wp.sqrt(real(2.0) * acceleration * (distance - real(0.5) * corner))


@wp.func
def limited_tilt(
    angle: real,
    angle_rate: real,
    target: real,
    target_rate: real,
    gain: real,
    rate_limit: real,
    acceleration_limit: real,
    dt: real,
) -> real:
    """Acceleration of a tilt angle towards its moving target within rate and acceleration limits."""
    wish = target_rate + approach_speed(target - angle, gain, BRAKING_SHARE * acceleration_limit)
    wish = wp.clamp(wish, -rate_limit, rate_limit)
    return wp.clamp((wish - angle_rate) / dt, -acceleration_limit, acceleration_limit)
