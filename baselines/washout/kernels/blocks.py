"""Structs and blocks of the classical washout; the other families use them, too.

**Filters.** Discretized by the trapezoidal rule, as states and accelerations. A high-pass before a double
integrator is one oscillator: its acceleration is the filter's output, and its position the integral. So the
zeros at s = 0 (z = 1) cancel the integrators exactly, and nothing drifts. Within a step the acceleration is
constant, as in the machine.

**Tilt coordination.** Eqs. (18) to (21), with limits of rate and acceleration that do not overshoot.

**Input.** A :class:`Reading`, from an observation or from the simulator's state.

**Command and anti-windup.** Accelerations are outputs of the filters' own states. The command adds a gentle
pull of the machine to this reference, and the reference is led to a machine that a limit held back. Both are
zero unless a limit has come between.
"""

from __future__ import annotations

from typing import Final

import warp as wp

from ....envs.arrays import mat33, real, real_rows, vec2, vec3, vec9
from ....envs.cues import GRAVITY
from ....envs.simulator.kernels.observation import SCALES, SLICES
from ....envs.simulator.kernels.step import State


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
def integrated(x: real, v: real, acceleration: real, dt: real) -> vec2:
    """Position and velocity after a step of constant acceleration."""
    return vec2(x + dt * v + real(0.5) * dt * dt * acceleration, v + dt * acceleration)


@wp.struct
class Parameters:
    """The kernel's form of :class:`~.parameters.WashoutParameters`."""

    force_scale: vec3
    force_limit: vec3
    rate_scale: vec3
    rate_limit: vec3
    hpr_roll: HighPassParameters
    hpr_pitch: HighPassParameters
    hpr_yaw: HighPassParameters
    rate_bandwidth: real
    tilt_gain: real  # 0 switches tilt coordination off
    tilt_frequency: real
    tilt_damping: real
    tilt_rate: real
    tilt_acceleration: real
    tilt_approach: real
    turntable_share: real  # k_T
    turntable_gain: real  # k_yr
    hps_x: HighPassParameters
    hps_y: HighPassParameters
    hpi_x: HighPassParameters
    hpi_y: HighPassParameters
    hpi_z: HighPassParameters
    carriage_share: real  # 0 leaves all to the hexapod
    lpc_frequency: real
    lpc_damping: real
    follow_frequency: real
    return_frequency: real
    cab: vec3  # D_o


@wp.struct
class Memory:
    """The states of all filters."""

    hpr_position: vec3
    hpr_velocity: vec3
    beta_hp: vec3  # beta1HP
    beta_hp_rate: vec3
    low_force: vec2  # fL
    low_force_rate: vec2
    tilt: vec2  # betaSL
    tilt_rate: vec2
    hps_position: vec2
    hps_velocity: vec2
    displacement: vec3  # Q'
    velocity: vec3
    carriage: vec2  # C'
    carriage_rate: vec2
    home: vec3  # Q' when the episode began
    recovery: real  # from 1 when a limit has held the machine back to 0 when that is long past
    psi_t_start: real  # where the turntable stood when the episode began
    psi_h_start: real  # the same of the hexapod's yaw


@wp.struct
class Reading:
    """Input of a step: reference cue and set-point of the machine."""

    force: vec3  # f_AA
    rate: vec3  # omega_AA
    carriage: vec2
    carriage_rate: vec2
    displacement: vec3
    velocity: vec3
    beta: vec3
    beta_rate: vec3
    psi_t: real  # within +-pi
    psi_t_rate: real


@wp.struct
class Rotation:
    """Rotation after SPLIT: beta_H and psi_T with their rates and accelerations."""

    beta: vec3
    beta_rate: vec3
    beta_acceleration: vec3
    psi_t: real
    psi_t_rate: real
    psi_t_acceleration: real


@wp.struct
class Command:
    """The accelerations of one step, and the filters after it."""

    action: vec9
    memory: Memory


@wp.struct
class Gains:
    """Factors before the high-passes that feed an integrator: 1 in the classical washout."""

    force: vec3  # on the output of HPS, in F_S
    rate: vec3  # on the Euler rates


@wp.struct
class Inputs:
    """Inputs of the high-passes of a step, before the gains."""

    euler_rates: vec3  # T_S omega'_AA
    a2s: vec3  # a2S: acceleration that the translations must add, in F_S
    a2s_passed: vec3  # output of HPS
    l_is: mat33


@wp.struct
class Step:
    """A step with the inputs of its high-passes."""

    command: Command
    inputs: Inputs
    q: vec3  # acceleration of Q'


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


@wp.func
def triple(row: real_rows, i: int, first: int, scale: real) -> vec3:
    """Three entries of an observation in SI units."""
    return vec3(row[i, first], row[i, first + 1], row[i, first + 2]) * scale


@wp.func
def pair(row: real_rows, i: int, first: int, scale: real) -> vec2:
    """Two entries of an observation in SI units."""
    return vec2(row[i, first], row[i, first + 1]) * scale


@wp.func
def read_observation(row: real_rows, i: int) -> Reading:
    """What the algorithm needs of an observation; see ``envs.simulator.kernels.observation``."""
    one = real(1.0)
    now = Reading()
    now.force = triple(
        row, i, wp.static(SLICES["reference_force"].start), real(wp.static(SCALES["reference_force"]))
    ) - vec3(real(0.0), real(0.0), real(wp.static(GRAVITY)))
    now.rate = triple(row, i, wp.static(SLICES["reference_rate"].start), one)
    now.carriage = pair(row, i, wp.static(SLICES["carriage"].start), real(wp.static(SCALES["carriage"])))
    now.carriage_rate = pair(
        row, i, wp.static(SLICES["carriage_rate"].start), real(wp.static(SCALES["carriage_rate"]))
    )
    now.displacement = triple(row, i, wp.static(SLICES["displacement"].start), one)
    now.velocity = triple(row, i, wp.static(SLICES["velocity"].start), one)
    now.beta = triple(row, i, wp.static(SLICES["beta"].start), one)
    now.beta_rate = triple(row, i, wp.static(SLICES["beta_rate"].start), one)
    angle = pair(row, i, wp.static(SLICES["turntable"].start), one)
    now.psi_t = wp.atan2(angle[0], angle[1])
    now.psi_t_rate = row[i, wp.static(SLICES["turntable_rate"].start)]
    return now


@wp.func
def read_state(state: State) -> Reading:
    """The same straight from the simulator's state."""
    p = state.setpoint
    now = Reading()
    now.force = state.reference_cue.force
    now.rate = state.reference_cue.rate
    now.carriage = vec2(p.position[0], p.position[1])
    now.carriage_rate = vec2(p.rate[0], p.rate[1])
    now.displacement = p.displacement
    now.velocity = p.velocity
    now.beta = p.beta
    now.beta_rate = p.beta_rate
    now.psi_t = p.position[8]
    now.psi_t_rate = p.rate[8]
    return now


HELD_BACK: Final = 0.001
"""Distance between machine and reference from which on a limit has held the machine back, m or rad."""

RETURNS: Final = 10.0
"""Multiple of 1 / return_frequency in which the return fades out after a limit."""


@wp.func
def return_acceleration(p: Parameters, order: int, recovery: real, x: real, v: real) -> real:
    """Acceleration that returns Q' after a limit, where HPI of this order would not."""
    if order == 2:
        return real(0.0)
    w = p.return_frequency
    return -recovery * (w * w * x + real(2.0) * w * v)


@wp.func
def with_return(p: Parameters, m: Memory, q: vec3) -> vec3:
    """Acceleration of Q' with its return after a limit; unchanged without one."""
    x = m.displacement - m.home
    v = m.velocity
    return q + vec3(
        return_acceleration(p, p.hpi_x.order, m.recovery, x[0], v[0]),
        return_acceleration(p, p.hpi_y.order, m.recovery, x[1], v[1]),
        return_acceleration(p, p.hpi_z.order, m.recovery, x[2], v[2]),
    )


@wp.func
def yaw_return_rate(p: Parameters, m: Memory) -> vec3:
    """Yaw rate that returns the hexapod's yaw after a limit; the turntable may stand anywhere."""
    share = real(1.0) - p.turntable_share
    return vec3(real(0.0), real(0.0), m.recovery * p.return_frequency * share * m.beta_hp[2])


@wp.func
def wrapped(angle: real) -> real:
    """An angle within +-pi."""
    return wp.atan2(wp.sin(angle), wp.cos(angle))


@wp.func
def tracking(p: Parameters, error: real, error_rate: real) -> real:
    """Acceleration that leads the machine back to the reference, critically damped."""
    w = p.follow_frequency
    return w * w * error + real(2.0) * w * error_rate


@wp.func
def command_axes(p: Parameters, m: Memory, now: Reading, r: Rotation, q: vec3, c: vec2) -> vec9:
    """The nine accelerations: the algorithm's own (Eq. (50): S' = Q' - C') and the pull to its reference."""
    surge = m.displacement[0] - m.carriage[0]
    sway = m.displacement[1] - m.carriage[1]
    surge_rate = m.velocity[0] - m.carriage_rate[0]
    sway_rate = m.velocity[1] - m.carriage_rate[1]
    return vec9(
        c[0] + tracking(p, m.carriage[0] - now.carriage[0], m.carriage_rate[0] - now.carriage_rate[0]),
        c[1] + tracking(p, m.carriage[1] - now.carriage[1], m.carriage_rate[1] - now.carriage_rate[1]),
        q[0] - c[0] + tracking(p, surge - now.displacement[0], surge_rate - now.velocity[0]),
        q[1] - c[1] + tracking(p, sway - now.displacement[1], sway_rate - now.velocity[1]),
        q[2] + tracking(p, m.displacement[2] - now.displacement[2], m.velocity[2] - now.velocity[2]),
        r.beta_acceleration[0] + tracking(p, r.beta[0] - now.beta[0], r.beta_rate[0] - now.beta_rate[0]),
        r.beta_acceleration[1] + tracking(p, r.beta[1] - now.beta[1], r.beta_rate[1] - now.beta_rate[1]),
        r.beta_acceleration[2] + tracking(p, r.beta[2] - now.beta[2], r.beta_rate[2] - now.beta_rate[2]),
        r.psi_t_acceleration + tracking(p, wrapped(r.psi_t - now.psi_t), r.psi_t_rate - now.psi_t_rate),
    )


@wp.func
def anti_windup(p: Parameters, m: Memory, now: Reading, r: Rotation, after: Memory, dt: real) -> Memory:
    """Anti-windup: leads the references towards a machine that a limit held back.

    Without a limit the machine is where the reference is, and this changes nothing.
    """
    k = p.follow_frequency * dt
    c = now.carriage - m.carriage
    c_rate = now.carriage_rate - m.carriage_rate
    moved_by = vec3(now.carriage[0], now.carriage[1], real(0.0)) + now.displacement - m.displacement
    moved_rate = vec3(now.carriage_rate[0], now.carriage_rate[1], real(0.0)) + now.velocity - m.velocity
    b = now.beta - r.beta
    b_rate = now.beta_rate - r.beta_rate
    turned = wrapped(now.psi_t - r.psi_t) / p.turntable_gain
    turned_rate = (now.psi_t_rate - r.psi_t_rate) / p.turntable_gain
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
def initial_memory(p: Parameters, now: Reading) -> Memory:
    """Filters at rest, their references where the machine is: C'(0), S'(0) and the tilt of the start pose."""
    m = Memory()
    m.carriage = now.carriage * p.carriage_share
    m.displacement = now.displacement + vec3(m.carriage[0], m.carriage[1], real(0.0))
    m.home = m.displacement
    m.tilt = vec2(now.beta[0], now.beta[1])
    m.psi_t_start = now.psi_t
    m.psi_h_start = now.beta[2]
    return m
