r"""One step of the classical washout, Figures 2 and 3 of the paper, block by block.

    omega_AA -> scale, limit -> T_S -> HPR -> beta1HP ----+-> SPLIT -> beta_H, psi_T
    f_AA -> scale, limit -> f1 -> LP -> N -> limit -> betaSL
                        \-> a2S -> HPS -> L_IS -> HPI -> Q' -> LPC -> C', S'

Symbols and equation numbers are the paper's. Command and anti-windup are in :mod:`.blocks`.
"""

from __future__ import annotations

import warp as wp

from ....envs.arrays import mat33, real, vec2, vec3
from ....envs.platform.kernels.geometry import (
    angular_acceleration,
    angular_velocity,
    cab_to_inertial,
    centripetal_part,
    gravity,
    point_on_platform,
    rate_matrix_inverse,
    relative_acceleration,
    turntable_rotation,
)
from .blocks import (
    Command,
    Gains,
    Inputs,
    Memory,
    Parameters,
    Reading,
    Rotation,
    Step,
    anti_windup,
    command_axes,
    high_pass,
    integrated,
    limited_tilt,
    low_pass,
    tilt_angle_rates,
    tilt_angles,
    with_return,
    yaw_return_rate,
)


@wp.func
def limited_force(p: Parameters, force: vec3) -> vec3:
    """f'_AA: scaled and limited; the z channel on f_z + g, so that gravity stays."""
    rest = -gravity()
    scaled = wp.cw_mul(p.force_scale, force - rest)
    return rest + wp.min(wp.max(scaled, -p.force_limit), p.force_limit)


@wp.func
def limited_rate_cue(p: Parameters, rate: vec3) -> vec3:
    """omega'_AA: scaled and limited."""
    return wp.min(wp.max(wp.cw_mul(p.rate_scale, rate), -p.rate_limit), p.rate_limit)


@wp.func
def high_pass_rates(p: Parameters, m: Memory, euler_rates: vec3, dt: real) -> vec3:
    """HPR FILT: the high-passed Euler rates of roll, pitch and yaw."""
    x = m.hpr_position
    v = m.hpr_velocity
    return vec3(
        high_pass(p.hpr_roll, x[0], v[0], euler_rates[0], dt),
        high_pass(p.hpr_pitch, x[1], v[1], euler_rates[1], dt),
        high_pass(p.hpr_yaw, x[2], v[2], euler_rates[2], dt),
    )


@wp.func
def tilt_acceleration(p: Parameters, m: Memory, psi: real, psi_rate: real, dt: real) -> vec2:
    """Eq. (19) and the limits behind it: accelerations of betaSL."""
    target = tilt_angles(m.low_force, psi) * p.tilt_gain
    target_rate = tilt_angle_rates(m.low_force, m.low_force_rate, psi, psi_rate) * p.tilt_gain
    roll = limited_tilt(
        m.tilt[0], m.tilt_rate[0], target[0], target_rate[0],
        p.tilt_approach, p.tilt_rate, p.tilt_acceleration, dt,
    )  # fmt: skip
    pitch = limited_tilt(
        m.tilt[1], m.tilt_rate[1], target[1], target_rate[1],
        p.tilt_approach, p.tilt_rate, p.tilt_acceleration, dt,
    )  # fmt: skip
    return vec2(roll, pitch)


@wp.func
def split(p: Parameters, m: Memory, beta_hp_acceleration: vec3, tilt: vec2) -> Rotation:
    """Eqs. (22), (25) to (27): betaS = beta1HP + betaSL between hexapod and turntable."""
    k_t = p.turntable_share
    k_h = real(1.0) - k_t
    r = Rotation()
    r.beta = vec3(m.beta_hp[0] + m.tilt[0], m.beta_hp[1] + m.tilt[1], m.psi_h_start + k_h * m.beta_hp[2])
    r.beta_rate = vec3(
        m.beta_hp_rate[0] + m.tilt_rate[0], m.beta_hp_rate[1] + m.tilt_rate[1], k_h * m.beta_hp_rate[2]
    )
    r.beta_acceleration = vec3(
        beta_hp_acceleration[0] + tilt[0], beta_hp_acceleration[1] + tilt[1], k_h * beta_hp_acceleration[2]
    )
    gain = k_t * p.turntable_gain
    r.psi_t = m.psi_t_start + gain * m.beta_hp[2]
    r.psi_t_rate = gain * m.beta_hp_rate[2]
    r.psi_t_acceleration = gain * beta_hp_acceleration[2]
    return r


@wp.func
def cab_relative_acceleration(p: Parameters, r: Rotation) -> vec3:
    """Eq. (37): aa_H at the cab's reference point."""
    return relative_acceleration(
        point_on_platform(p.cab, r.psi_t),
        angular_velocity(r.beta, r.beta_rate),
        angular_acceleration(r.beta, r.beta_rate, r.beta_acceleration),
        r.psi_t_rate,
        r.psi_t_acceleration,
    )


@wp.func
def a2s_acceleration(p: Parameters, r: Rotation, l_is: mat33, force: vec3) -> vec3:
    """Eq. (48): a2S, what the translations must add."""
    aa_s = wp.transpose(turntable_rotation(r.psi_t)) * cab_relative_acceleration(p, r)
    return force - aa_s + wp.transpose(l_is) * gravity()


@wp.func
def high_pass_in_cab(p: Parameters, m: Memory, a2s: vec3, dt: real) -> vec3:
    """HPS FILT: x and y high-passed in F_S."""
    x = m.hps_position
    v = m.hps_velocity
    return vec3(
        high_pass(p.hps_x, x[0], v[0], a2s[0], dt), high_pass(p.hps_y, x[1], v[1], a2s[1], dt), a2s[2]
    )


@wp.func
def high_pass_in_space(p: Parameters, x: vec3, v: vec3, a2i: vec3, dt: real) -> vec3:
    """HPI FILT: the acceleration of an oscillator at x, in F_I."""
    return vec3(
        high_pass(p.hpi_x, x[0], v[0], a2i[0], dt),
        high_pass(p.hpi_y, x[1], v[1], a2i[1], dt),
        high_pass(p.hpi_z, x[2], v[2], a2i[2], dt),
    )


@wp.func
def carriage_acceleration(p: Parameters, m: Memory, dt: real) -> vec2:
    """Eq. (49): acceleration of C' = LPC Q'."""
    a_x = low_pass(p.lpc_frequency, p.lpc_damping, m.carriage[0], m.carriage_rate[0], m.displacement[0], dt)
    a_y = low_pass(p.lpc_frequency, p.lpc_damping, m.carriage[1], m.carriage_rate[1], m.displacement[1], dt)
    return vec2(a_x, a_y) * p.carriage_share


@wp.func
def advance_rotation(
    p: Parameters, m: Memory, high_passed: vec3, alpha: vec3, tilt: vec2, dt: real
) -> Memory:
    """The rotational filters after the step."""
    after = m
    after.hpr_position = m.hpr_position + dt * m.hpr_velocity + (real(0.5) * dt * dt) * high_passed
    after.hpr_velocity = m.hpr_velocity + dt * high_passed
    after.beta_hp = m.beta_hp + dt * m.beta_hp_rate + (real(0.5) * dt * dt) * alpha
    after.beta_hp_rate = m.beta_hp_rate + dt * alpha
    after.tilt = m.tilt + dt * m.tilt_rate + (real(0.5) * dt * dt) * tilt
    after.tilt_rate = m.tilt_rate + dt * tilt
    return after


@wp.func
def advance_low_pass(p: Parameters, m: Memory, f1: vec3, dt: real) -> Memory:
    """LP FILT after the step: fL."""
    a_x = low_pass(p.tilt_frequency, p.tilt_damping, m.low_force[0], m.low_force_rate[0], f1[0], dt)
    a_y = low_pass(p.tilt_frequency, p.tilt_damping, m.low_force[1], m.low_force_rate[1], f1[1], dt)
    after = m
    x = integrated(m.low_force[0], m.low_force_rate[0], a_x, dt)
    y = integrated(m.low_force[1], m.low_force_rate[1], a_y, dt)
    after.low_force = vec2(x[0], y[0])
    after.low_force_rate = vec2(x[1], y[1])
    return after


@wp.func
def advance_translation(m: Memory, q: vec3, c: vec2, dt: real) -> Memory:
    """Q' and C' after the step."""
    after = m
    after.displacement = m.displacement + dt * m.velocity + (real(0.5) * dt * dt) * q
    after.velocity = m.velocity + dt * q
    after.carriage = m.carriage + dt * m.carriage_rate + (real(0.5) * dt * dt) * c
    after.carriage_rate = m.carriage_rate + dt * c
    return after


@wp.func
def cab_angles(p: Parameters, m: Memory) -> vec3:
    """BetaS. The cab's true yaw: with k_yr or a turned start it is not the integral of the yaw cue."""
    psi_s = m.psi_t_start + m.psi_h_start + yaw_share(p) * m.beta_hp[2]
    return vec3(m.beta_hp[0] + m.tilt[0], m.beta_hp[1] + m.tilt[1], psi_s)


@wp.func
def yaw_share(p: Parameters) -> real:
    """Yaw of the cab for a yaw cue of 1: other than 1 if k_yr is."""
    return real(1.0) + p.turntable_share * (p.turntable_gain - real(1.0))


@wp.func
def advance_high_pass_in_cab(m: Memory, passed: vec3, dt: real) -> Memory:
    """HPS FILT after the step."""
    after = m
    hps_x = integrated(m.hps_position[0], m.hps_velocity[0], passed[0], dt)
    hps_y = integrated(m.hps_position[1], m.hps_velocity[1], passed[1], dt)
    after.hps_position = vec2(hps_x[0], hps_y[0])
    after.hps_velocity = vec2(hps_x[1], hps_y[1])
    return after


@wp.func
def rate_roll_off(p: Parameters, dt: real) -> real:
    """Angular acceleration for each rad/s of rate that is still missing, 1/s."""
    return p.rate_bandwidth / (real(1.0) + real(0.5) * dt * p.rate_bandwidth)


@wp.func
def washout_with(p: Parameters, gains: Gains, m: Memory, now: Reading, dt: real) -> Step:
    """One step with gains before the high-passes, in the paper's order of blocks."""
    force = limited_force(p, now.force)
    beta_s = cab_angles(p, m)
    inputs = Inputs()
    inputs.euler_rates = rate_matrix_inverse(beta_s) * limited_rate_cue(p, now.rate)
    high_passed = high_pass_rates(p, m, wp.cw_mul(gains.rate, inputs.euler_rates), dt)
    alpha = (high_passed - yaw_return_rate(p, m) - m.beta_hp_rate) * rate_roll_off(p, dt)
    tilt = tilt_acceleration(p, m, beta_s[2], yaw_share(p) * m.beta_hp_rate[2], dt)
    r = split(p, m, alpha, tilt)

    aa1_h = centripetal_part(point_on_platform(p.cab, r.psi_t), r.psi_t_rate)
    f1 = force - wp.transpose(turntable_rotation(r.psi_t)) * aa1_h
    inputs.l_is = cab_to_inertial(r.beta, r.psi_t)
    inputs.a2s = a2s_acceleration(p, r, inputs.l_is, force)
    inputs.a2s_passed = high_pass_in_cab(p, m, inputs.a2s, dt)
    a2i = inputs.l_is * wp.cw_mul(gains.force, inputs.a2s_passed)
    q = with_return(p, m, high_pass_in_space(p, m.displacement, m.velocity, a2i, dt))
    c = carriage_acceleration(p, m, dt)

    after = advance_translation(advance_high_pass_in_cab(m, inputs.a2s_passed, dt), q, c, dt)
    after = advance_rotation(p, after, high_passed, alpha, tilt, dt)
    after = advance_low_pass(p, after, f1, dt)
    out = Step()
    out.command.memory = anti_windup(p, m, now, r, after, dt)
    out.command.action = command_axes(p, m, now, r, q, c)
    out.inputs = inputs
    out.q = q
    return out


@wp.func
def washout(p: Parameters, m: Memory, now: Reading, dt: real) -> Command:
    """One step of the classical washout."""
    one = real(1.0)
    gains = Gains()
    gains.force = vec3(one, one, one)
    gains.rate = vec3(one, one, one)
    return washout_with(p, gains, m, now, dt).command
