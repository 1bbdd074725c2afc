"""Machine and reference of a washout: the command that keeps them together, and what happens after a limit.

All accelerations are outputs of the filters' own states. They are the machine's command, plus a gentle pull
back to the algorithm's own reference, and the reference is led back to the machine; both are zero unless a
limit has come between.
"""

from __future__ import annotations

from typing import Final

import warp as wp

from ...envs.precision import real, vec2, vec3, vec9
from .structs import Memory, Parameters, Reading, Rotation

HELD_BACK: Final = 0.001
"""Distance between machine and reference that says that a limit has come between, m or rad."""

RETURNS: Final = 10.0
"""Times 1 / return_frequency in which the way home fades out after a limit."""


@wp.func
def homeward(p: Parameters, order: int, recovery: real, x: real, v: real) -> real:
    """Acceleration that leads Q' home after a limit, where HPI of this order would not."""
    if order == 2:
        return real(0.0)
    w = p.return_frequency
    return -recovery * (w * w * x + real(2.0) * w * v)


@wp.func
def recovered(p: Parameters, m: Memory, q: vec3) -> vec3:
    """The acceleration of Q' with what leads it home; without a limit it is as it was."""
    x = m.displacement - m.home
    v = m.velocity
    return q + vec3(
        homeward(p, p.hpi_x.order, m.recovery, x[0], v[0]),
        homeward(p, p.hpi_y.order, m.recovery, x[1], v[1]),
        homeward(p, p.hpi_z.order, m.recovery, x[2], v[2]),
    )


@wp.func
def hexapod_yaw_home(p: Parameters, m: Memory) -> vec3:
    """Yaw rate that takes the hexapod's yaw home after a limit; the turntable may stand anywhere."""
    share = real(1.0) - p.turntable_share
    return vec3(real(0.0), real(0.0), m.recovery * p.return_frequency * share * m.beta_hp[2])


@wp.func
def wrapped(angle: real) -> real:
    """An angle within +-pi."""
    return wp.atan2(wp.sin(angle), wp.cos(angle))


@wp.func
def pull(p: Parameters, error: real, error_rate: real) -> real:
    """Acceleration that leads the machine back to the reference, critically damped."""
    w = p.follow_frequency
    return w * w * error + real(2.0) * w * error_rate


@wp.func
def command_axes(p: Parameters, m: Memory, seen: Reading, r: Rotation, q: vec3, c: vec2) -> vec9:
    """The nine accelerations: the algorithm's own (Eq. (50): S' = Q' - C') and the pull to its reference."""
    surge = m.displacement[0] - m.carriage[0]
    sway = m.displacement[1] - m.carriage[1]
    surge_rate = m.velocity[0] - m.carriage_rate[0]
    sway_rate = m.velocity[1] - m.carriage_rate[1]
    return vec9(
        c[0] + pull(p, m.carriage[0] - seen.carriage[0], m.carriage_rate[0] - seen.carriage_rate[0]),
        c[1] + pull(p, m.carriage[1] - seen.carriage[1], m.carriage_rate[1] - seen.carriage_rate[1]),
        q[0] - c[0] + pull(p, surge - seen.displacement[0], surge_rate - seen.velocity[0]),
        q[1] - c[1] + pull(p, sway - seen.displacement[1], sway_rate - seen.velocity[1]),
        q[2] + pull(p, m.displacement[2] - seen.displacement[2], m.velocity[2] - seen.velocity[2]),
        r.beta_acceleration[0] + pull(p, r.beta[0] - seen.beta[0], r.beta_rate[0] - seen.beta_rate[0]),
        r.beta_acceleration[1] + pull(p, r.beta[1] - seen.beta[1], r.beta_rate[1] - seen.beta_rate[1]),
        r.beta_acceleration[2] + pull(p, r.beta[2] - seen.beta[2], r.beta_rate[2] - seen.beta_rate[2]),
        r.psi_t_acceleration + pull(p, wrapped(r.psi_t - seen.psi_t), r.psi_t_rate - seen.psi_t_rate),
    )


@wp.func
def led_back(p: Parameters, m: Memory, seen: Reading, r: Rotation, after: Memory, dt: real) -> Memory:
    """The references led towards a machine that a limit held back, so that nothing winds up.

    Without a limit the machine is where the reference is, and this changes nothing.
    """
    k = p.follow_frequency * dt
    c = seen.carriage - m.carriage
    c_rate = seen.carriage_rate - m.carriage_rate
    moved_by = vec3(seen.carriage[0], seen.carriage[1], real(0.0)) + seen.displacement - m.displacement
    moved_rate = vec3(seen.carriage_rate[0], seen.carriage_rate[1], real(0.0)) + seen.velocity - m.velocity
    b = seen.beta - r.beta
    b_rate = seen.beta_rate - r.beta_rate
    turned = wrapped(seen.psi_t - r.psi_t) / p.turntable_gain
    turned_rate = (seen.psi_t_rate - r.psi_t_rate) / p.turntable_gain
    yaw = (real(1.0) - p.turntable_share) * b[2] + p.turntable_share * turned
    yaw_rate = (real(1.0) - p.turntable_share) * b_rate[2] + p.turntable_share * turned_rate
    zero = real(0.0)
    out = after
    out.carriage = after.carriage + k * c * p.carriage_share
    out.carriage_rate = after.carriage_rate + k * c_rate * p.carriage_share
    out.displacement = after.displacement + k * moved_by
    out.velocity = after.velocity + k * moved_rate
    out.tilt = after.tilt + k * vec2(b[0], b[1])
    out.tilt_rate = after.tilt_rate + k * vec2(b_rate[0], b_rate[1])
    out.beta_hp = after.beta_hp + k * vec3(zero, zero, yaw)
    out.beta_hp_rate = after.beta_hp_rate + k * vec3(zero, zero, yaw_rate)
    fading = real(1.0) - p.return_frequency * dt / real(wp.static(RETURNS))
    held_back = wp.max(wp.length(moved_by), wp.abs(b[2])) / real(wp.static(HELD_BACK))
    out.recovery = wp.max(m.recovery * fading, wp.min(held_back, real(1.0)))
    return out


@wp.func
def initial_memory(p: Parameters, seen: Reading) -> Memory:
    """Filters at rest, their references where the machine is: C'(0), S'(0) and the tilt of the start pose."""
    m = Memory()
    m.carriage = seen.carriage * p.carriage_share
    m.displacement = seen.displacement + vec3(m.carriage[0], m.carriage[1], real(0.0))
    m.home = m.displacement
    m.tilt = vec2(seen.beta[0], seen.beta[1])
    m.psi_t_start = seen.psi_t
    m.psi_h_start = seen.beta[2]
    return m
