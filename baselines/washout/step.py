r"""One step of the classical washout, Figures 2 and 3 of the paper, block by block.

    omega_AA -> scale, limit -> T_S -> HPR -> beta1HP ----+-> SPLIT -> beta_H, psi_T
    f_AA -> scale, limit -> f1 -> LP -> N -> limit -> betaSL
                        \-> a2S -> HPS -> L_IS -> HPI -> Q' -> LPC -> C', S'

All accelerations are outputs of the filters' own states. They are the machine's command, plus a gentle pull
back to the algorithm's own reference, and the reference is led back to the machine; both are zero unless a
limit has come between.
"""

from __future__ import annotations

from typing import Final

import warp as wp

from ...envs.platform.cab import (
    cab_to_inertial,
    centripetal_part,
    gravity,
    point_on_platform,
    relative_acceleration,
)
from ...envs.platform.frames import (
    angular_acceleration,
    angular_velocity,
    rate_matrix_inverse,
    turntable_rotation,
)
from ...envs.precision import real, vec2, vec3, vec9
from .filters import HighPassParameters, high_pass, low_pass, moved
from .tilt import limited_tilt, tilt_angle_rates, tilt_angles

HELD_BACK: Final = 0.001
"""Distance between machine and reference that says that a limit has come between, m or rad."""

RETURNS: Final = 10.0
"""Times 1 / return_frequency in which the way home fades out after a limit."""


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
    """What the algorithm reads from an observation."""

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
    """The rotational half of a step: beta_H and psi_T with their rates and accelerations."""

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
def high_passed_motion(p: Parameters, m: Memory, r: Rotation, force: vec3, dt: real) -> Command:
    """Eq. (48), HPS, L_IS, HPI: the acceleration of Q' in F_I, as the first three entries of the action."""
    l_is = cab_to_inertial(r.beta, r.psi_t)
    aa_s = wp.transpose(turntable_rotation(r.psi_t)) * cab_relative_acceleration(p, r)
    a2s = force - aa_s + wp.transpose(l_is) * gravity()
    x = m.hps_position
    v = m.hps_velocity
    filtered = vec3(
        high_pass(p.hps_x, x[0], v[0], a2s[0], dt), high_pass(p.hps_y, x[1], v[1], a2s[1], dt), a2s[2]
    )
    after = m
    hps_x = moved(x[0], v[0], filtered[0], dt)
    hps_y = moved(x[1], v[1], filtered[1], dt)
    after.hps_position = vec2(hps_x[0], hps_y[0])
    after.hps_velocity = vec2(hps_x[1], hps_y[1])
    a2i = l_is * filtered
    q = m.displacement
    q_rate = m.velocity
    a_x = high_pass(p.hpi_x, q[0], q_rate[0], a2i[0], dt)
    a_y = high_pass(p.hpi_y, q[1], q_rate[1], a2i[1], dt)
    a_z = high_pass(p.hpi_z, q[2], q_rate[2], a2i[2], dt)
    out = Command()
    out.memory = after
    zero = real(0.0)
    out.action = vec9(a_x, a_y, a_z, zero, zero, zero, zero, zero, zero)
    return out


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
def carriage_acceleration(p: Parameters, m: Memory, dt: real) -> vec2:
    """Eq. (49): acceleration of C' = LPC Q'."""
    a_x = low_pass(p.lpc_frequency, p.lpc_damping, m.carriage[0], m.carriage_rate[0], m.displacement[0], dt)
    a_y = low_pass(p.lpc_frequency, p.lpc_damping, m.carriage[1], m.carriage_rate[1], m.displacement[1], dt)
    return vec2(a_x, a_y) * p.carriage_share


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
    x = moved(m.low_force[0], m.low_force_rate[0], a_x, dt)
    y = moved(m.low_force[1], m.low_force_rate[1], a_y, dt)
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


@wp.func
def washout(p: Parameters, m: Memory, seen: Reading, dt: real) -> Command:
    """One step: reading-notes' order of blocks."""
    force = limited_force(p, seen.force)
    rate = limited_rate_cue(p, seen.rate)

    # The cab's true yaw: with k_yr or a turned start it is not the integral of the yaw cue.
    turn = real(1.0) + p.turntable_share * (p.turntable_gain - real(1.0))
    psi_s = m.psi_t_start + m.psi_h_start + turn * m.beta_hp[2]
    beta_s = vec3(m.beta_hp[0] + m.tilt[0], m.beta_hp[1] + m.tilt[1], psi_s)
    high_passed = high_pass_rates(p, m, rate_matrix_inverse(beta_s) * rate, dt)
    bandwidth = p.rate_bandwidth / (real(1.0) + real(0.5) * dt * p.rate_bandwidth)
    alpha = (high_passed - hexapod_yaw_home(p, m) - m.beta_hp_rate) * bandwidth

    tilt = tilt_acceleration(p, m, psi_s, turn * m.beta_hp_rate[2], dt)
    r = split(p, m, alpha, tilt)

    aa1_h = centripetal_part(point_on_platform(p.cab, r.psi_t), r.psi_t_rate)
    f1 = force - wp.transpose(turntable_rotation(r.psi_t)) * aa1_h
    linear = high_passed_motion(p, m, r, force, dt)
    q = recovered(p, m, vec3(linear.action[0], linear.action[1], linear.action[2]))
    c = carriage_acceleration(p, m, dt)

    after = advance_translation(linear.memory, q, c, dt)
    after = advance_rotation(p, after, high_passed, alpha, tilt, dt)
    after = advance_low_pass(p, after, f1, dt)
    after = led_back(p, m, seen, r, after, dt)

    out = Command()
    out.action = command_axes(p, m, seen, r, q, c)
    out.memory = after
    return out
